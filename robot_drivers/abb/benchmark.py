"""How soon EGM datagrams are answered while the arm is guided, a plot is drawn and a file is written.

The controller is emulated in a process of its own, at 248 Hz, and so are plot and file; the time of an answer runs from
the sending of a datagram to the arrival of its answer in the kernel. The arm goes to and fro by a centimetre.

Usage::

    python -m robot_drivers.abb.benchmark --seconds 60
    python -m robot_drivers.abb.benchmark --seconds 10 --idle

The exit status is 1 where 99.9 % of the answers take 2 ms or more, or a datagram has none.
"""

import argparse
import contextlib
import json
import math
import multiprocessing
import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from robot_drivers.abb import egm_load
from robot_drivers.abb.egm.guidance import EGMGuidedRobot
from robot_drivers.abb.egm.guidance_session import EGMGuidanceSettings
from robot_drivers.abb.egm.position_stream import EGMSettings
from robot_drivers.abb.egm.udp import StampedSocket
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Pose, Speed
from robot_drivers.real_time import shorten_collections

LATEST_ANSWER_S = 2e-3
"""What 99.9 % of the answers must keep below."""

_STROKE_M = 0.01
_SPEED = Speed(linear=0.02, angular=0.1)
_MOVE_TIMEOUT_S = 5.0
_START_S = 10.0


@dataclass(frozen=True, slots=True)
class AnswerTimes:
    """Times of the answers, s, ascending; how many datagrams had none; and the load of the machine, of one minute."""

    answered_s: tuple[float, ...]
    unanswered: int
    machine_load: float

    def percentile(self, percent: float) -> float:
        """Return the time that so many percent of the answers do not exceed, s."""
        rank = math.ceil(percent / 100 * len(self.answered_s))
        return self.answered_s[max(rank - 1, 0)] if self.answered_s else math.inf

    @property
    def good(self) -> bool:
        """Whether the answers were soon enough."""
        return not self.unanswered and self.percentile(99.9) < LATEST_ANSWER_S

    def __str__(self) -> str:
        parts = [f"p{percent:g} {1e3 * self.percentile(percent):.3f} ms" for percent in (50, 99, 99.9)]
        return (
            f"{len(self.answered_s) + self.unanswered} datagrams, {self.unanswered} without answer; "
            f"{', '.join(parts)}, longest {1e3 * self.percentile(100):.3f} ms; "
            f"load of the machine {self.machine_load:.1f}"
        )


def run(seconds: float, loaded: bool) -> AnswerTimes:
    """Guide an emulated controller for so long, with or without plot and file beside it."""
    with contextlib.ExitStack() as stack:
        if loaded:
            stack.enter_context(_load())
        probe = StampedSocket("127.0.0.1", 0)
        port = probe.port
        probe.close()
        robot = EGMGuidedRobot(
            EGMGuidanceSettings(EGMSettings(port=port, bind_address="127.0.0.1"), connect_timeout_s=_START_S)
        )
        command = [
            sys.executable,
            "-m",
            "robot_drivers.abb.emulator.pacer",
            "127.0.0.1",
            str(port),
            str(seconds),
        ]
        pacer = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        stack.callback(pacer.terminate)
        robot.connect()
        stack.callback(robot.close)
        shorten_collections()
        ended = threading.Event()
        mover = threading.Thread(target=_move_to_and_fro, args=(robot, ended))
        mover.start()
        try:
            printed, _ = pacer.communicate()
        finally:
            ended.set()
            mover.join()
    times = json.loads(printed)
    answered = tuple(sorted(time_s for time_s in times if time_s is not None))
    load = os.getloadavg()[0] if sys.platform != "win32" else math.nan
    return AnswerTimes(answered, len(times) - len(answered), load)


def _move_to_and_fro(robot: EGMGuidedRobot, ended: threading.Event) -> None:
    here = robot.state().T_base_tool
    x, y, z = here.position
    ends = (Pose((x + _STROKE_M, y, z), here.quaternion_wxyz), here)
    with contextlib.suppress(DeviceError):  # the controller ends its session in the middle of a motion
        while not ended.is_set():
            for target in ends:
                robot.move_linear(target, _SPEED, _MOVE_TIMEOUT_S)


@contextmanager
def _load() -> Iterator[None]:
    context = multiprocessing.get_context("spawn")
    ended = context.Event()
    processes = [context.Process(target=work, args=(ended,)) for work in (egm_load.plot, egm_load.write)]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        ended.set()
        for process in processes:
            process.join()


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the times of the answers."""
    parser = argparse.ArgumentParser(
        prog="python -m robot_drivers.abb.benchmark",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seconds", type=float, default=10.0, help="default %(default)s")
    parser.add_argument("--idle", action="store_true", help="without plot and file")
    options = parser.parse_args(arguments)
    times = run(options.seconds, loaded=not options.idle)
    sys.stdout.write(f"{times}\n")
    return 0 if times.good else 1


if __name__ == "__main__":
    sys.exit(main())
