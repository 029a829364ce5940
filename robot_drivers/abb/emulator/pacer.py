"""A controller that only keeps time: EGM every 4.032 ms to a PC that guides it, and how long each answer took.

The arm stands wherever the PC wants it at once. ``python -m robot_drivers.abb.emulator.pacer HOST PORT SECONDS`` prints
one JSON list: for each datagram the time from sending it until the kernel had its answer, s, or null without one. The
answer to a later datagram answers those before it as well.
"""

import json
import sys
from collections.abc import Sequence

from robot_drivers.abb.egm.codec import MciState, decode_sensor
from robot_drivers.abb.egm.protobuf import encode
from robot_drivers.abb.egm.udp import StampedSocket
from robot_drivers.abb.emulator.arm import CYCLE_S, Arm, Reading
from robot_drivers.abb.emulator.egm import ControllerSample, robot_message
from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.clock import host_time_ns

_LAST_ANSWERS_S = 0.5


def answer_times(pc: tuple[str, int], seconds: float) -> list[float | None]:
    """Guide for so long; return the time of each answer, s, None where none came.

    An answer belongs to the datagram whose time of sample, in ms, it carries in ``tm``.
    """
    socket = StampedSocket("127.0.0.1", 0)
    reading = Arm(ArmSettings()).reference()
    sent_ns: dict[int, int] = {}
    answered_ns: dict[int, int] = {}
    try:
        begin_ns = host_time_ns()
        count = round(seconds / CYCLE_S)
        for number in range(count + round(_LAST_ANSWERS_S / CYCLE_S)):
            controller_us = 10_000_000 + round(number * CYCLE_S * 1e6)
            message = encode(
                robot_message(
                    "B'", number, ControllerSample(controller_us, reading, reading, mci=MciState.RUNNING)
                )
            )
            if number < count:
                sent_ns[round(controller_us / 1000)] = host_time_ns()
                socket.send(message, pc)
            due_ns = begin_ns + round((number + 1) * CYCLE_S * 1e9)
            while (wait_ns := due_ns - host_time_ns()) > 0:
                for answer in socket.receive(wait_ns * 1e-9):
                    reading, of_ms = _take(answer.content, reading)
                    answered_ns.setdefault(of_ms, answer.host_time_ns)
    finally:
        socket.close()
    times: list[float | None] = []
    soonest_ns: int | None = None
    for ms, sent in reversed(sent_ns.items()):
        arrivals = [stamp for stamp in (soonest_ns, answered_ns.get(ms)) if stamp is not None]
        soonest_ns = min(arrivals, default=None)
        times.append(None if soonest_ns is None else (soonest_ns - sent) * 1e-9)
    return times[::-1]


def _take(answer: bytes, reading: Reading) -> tuple[Reading, int]:
    """Return what the encoders read once the arm stands at the reference, and the time that the answer is for, ms."""
    sensor = decode_sensor(answer)
    cartesian = None if sensor.planned is None else sensor.planned.cartesian
    of_ms = -1 if sensor.header is None or sensor.header.tm is None else sensor.header.tm
    if cartesian is None or cartesian.pos is None or cartesian.orient is None:
        return reading, of_ms
    p, q = cartesian.pos, cartesian.orient
    return Reading((p.x, p.y, p.z), (q.u0, q.u1, q.u2, q.u3), reading.joints_deg), of_ms


def main(arguments: Sequence[str] | None = None) -> int:
    """Pace a PC and print the times of its answers."""
    host, port, seconds = arguments or sys.argv[1:]
    times = answer_times((host, int(port)), float(seconds))
    sys.stdout.write(json.dumps(times) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
