"""EGM of the emulated controller: what one datagram holds in each generation, and the position stream."""

import math
import random
import socket
from collections import deque
from dataclasses import dataclass

from robot_drivers.abb.egm.codec import (
    EgmCartesian,
    EgmClock,
    EgmCollisionInfo,
    EgmEuler,
    EgmHeader,
    EgmJoints,
    EgmMeasuredForce,
    EgmMotion,
    EgmPose,
    EgmQuaternion,
    EgmRapidData,
    EgmRobot,
    EgmState,
    EgmTimestamp,
    MciState,
    MessageType,
    MotorState,
    RapidState,
)
from robot_drivers.abb.egm.protobuf import encode
from robot_drivers.abb.emulator.arm import Reading
from robot_drivers.abb.emulator.settings import ControllerFaults
from robot_drivers.clock import host_time_s
from robot_drivers.interfaces import address_towards

GENERATIONS = ("A", "B", "B'", "C", "D")

_NO_FORCE = (0.0,) * 6
_SEND_DELAY_MS = 4  # a datagram leaves about one cycle after its sample
_RUBBISH_BYTES = 120
_UINT32 = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class ControllerSample:
    """What the controller knows in one cycle: its clock, µs, the arm, and how it is driven.

    ``mci`` is the state of guidance; ``converged`` whether the arm stands at the reference of the PC.
    """

    controller_us: int
    measured: Reading
    planned: Reading
    motors_on: bool = True
    rapid_running: bool = True
    mci: MciState = MciState.STOPPED
    converged: bool = False


def robot_message(generation: str, seqno: int, sample: ControllerSample) -> EgmRobot:
    """Return what a controller without force control tells about one sample.

    The generations are those of :mod:`~robot_drivers.abb.egm.codec`. A and B have neither Euler angles nor utilization,
    so that a message of B has 301 bytes.
    """
    since_610, since_614, newest = generation not in "AB", generation in "CD", generation == "D"
    return EgmRobot(
        header=EgmHeader(seqno, (sample.controller_us // 1000 + _SEND_DELAY_MS) & _UINT32, MessageType.DATA),
        feed_back=_motion(generation, sample.measured, sample.controller_us),
        planned=_motion(generation, sample.planned, sample.controller_us),
        motor_state=EgmState(MotorState.ON if sample.motors_on else MotorState.OFF),
        mci_state=EgmState(sample.mci),
        mci_convergence_met=sample.converged,
        rapid_exec_state=EgmState(RapidState.RUNNING if sample.rapid_running else RapidState.STOPPED),
        measured_force=EgmMeasuredForce(fc_active=False, force=_NO_FORCE) if since_614 else None,
        utilization_rate=50.0 if since_610 else None,
        move_index=0 if since_614 else None,
        collision_info=EgmCollisionInfo(False) if newest else None,
        rapid_from_robot=EgmRapidData(False, (0.0,)) if newest else None,
        torque_ref=EgmJoints(_NO_FORCE) if newest else None,
    )


class EgmSender:
    """Sends datagrams to the PC, and loses, doubles, swaps and spoils some on request."""

    def __init__(self, remote: tuple[str, int], seed: int) -> None:
        self._remote = remote
        self._random = random.Random(seed)
        self._kept_back: bytes | None = None
        self._on_the_way: deque[tuple[float, bytes]] = deque()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind((address_towards(remote[0]), 0))

    def send(self, message: EgmRobot, faults: ControllerFaults) -> None:
        """Send one message, as the faults allow."""
        self._send_due()
        datagram = encode(message)
        if self._happens(faults.egm_loss):
            return
        if self._happens(faults.egm_truncation):
            datagram = datagram[: self._random.randrange(len(datagram))]
        if self._kept_back is None and self._happens(faults.egm_reorder):
            self._kept_back = datagram
            return
        leaving = [datagram]
        if self._kept_back is not None:
            leaving.append(self._kept_back)
            self._kept_back = None
        if self._happens(faults.egm_duplicate):
            leaving.append(datagram)
        if self._happens(faults.egm_rubbish):
            leaving.append(self._random.randbytes(_RUBBISH_BYTES))
        due_s = host_time_s() + faults.egm_delay_s
        self._on_the_way.extend((due_s, datagram) for datagram in leaving)
        self._send_due()

    def receive(self) -> bytes | None:
        """Return the next datagram of the PC, None if there is none. A controller takes one in a cycle."""
        try:
            return self._socket.recv(4096)
        except (
            BlockingIOError,
            ConnectionRefusedError,
        ):  # the latter: nobody listened to an earlier datagram
            return None

    def close(self) -> None:
        """Release the socket."""
        self._socket.close()

    def _happens(self, probability: float) -> bool:
        return probability > 0 and self._random.random() < probability

    def _send_due(self) -> None:
        while self._on_the_way and self._on_the_way[0][0] <= host_time_s():
            self._socket.sendto(self._on_the_way.popleft()[1], self._remote)


def _motion(generation: str, reading: Reading, controller_us: int) -> EgmMotion:
    joints = reading.joints_deg if generation != "A" else tuple(map(math.radians, reading.joints_deg))
    seconds, microseconds = divmod(controller_us, 1_000_000)
    return EgmMotion(
        joints=EgmJoints(joints),
        cartesian=EgmPose(
            EgmCartesian(*reading.position_mm),
            EgmQuaternion(*reading.quaternion_wxyz),
            None if generation in "AB" else _euler(reading.quaternion_wxyz),
        ),
        time=None if generation == "A" else EgmClock(seconds, microseconds),
        time_stamp=EgmTimestamp(seconds, microseconds * 1000) if generation == "D" else None,
    )


def _euler(quaternion_wxyz: tuple[float, float, float, float]) -> EgmEuler:
    """Return the angles of R = Rz Ry Rx, degrees."""
    w, x, y, z = quaternion_wxyz
    about_x = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    about_y = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    about_z = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return EgmEuler(math.degrees(about_x), math.degrees(about_y), math.degrees(about_z))
