"""EGM Position Stream: the controller sends its measured and planned pose 250 times a second, the PC listens.

The PC is the UDP server, the controller speaks first and expects no answer. Every datagram is kept with the
kernel's receive stamp, the controller's clock and its unwrapped sequence number.
"""

import math
import socket
import time
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robot_drivers.abb.egm.codec import EgmMeasuredForce, EgmMotion, EgmRobot, decode_robot
from robot_drivers.abb.egm.udp import Datagram, StampedSocket
from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.abb.sequence import SequenceAccount
from robot_drivers.errors import ConfigurationError, DeviceProtocolError, DeviceUnreachableError
from robot_drivers.interfaces import LOOPBACK, address_towards, is_loopback
from robot_drivers.protocols import Pose, PoseBlock, StreamStatistics

_STANDING_RAD_S = 5e-4  # planned joint speed; a float32 angle near 90° resolves 3e-5 rad/s at 250 Hz
_METRES_PER_MM = 1e-3
_QUATERNION_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class EGMSettings:
    """Where the controller sends its stream.

    Attributes
    ----------
    port : UDP port of this computer; the controller's UDPUC device names it as remote port
    bind_address : address of the network interface to listen on; None for the one towards ``controller_address``, or
        for the loopback where there is none. On another than the loopback, the controller's address is needed
    controller_address : only datagrams from here count; None takes whoever sends the first valid one
    untimed_joint_unit : unit of the joint angles in messages without a time field (RobotWare 6.00 – 6.06). The
        client library abb_libegm took them for radians; this was not confirmed on a controller
    """

    port: int = 6510
    bind_address: str | None = None
    controller_address: str | None = None
    untimed_joint_unit: Literal["rad", "deg"] = "rad"


@dataclass(frozen=True, slots=True)
class EGMSample:
    """One message in SI units: clock in s, ``T_base_tool``, joint angles (rad), measured and planned.

    ``moving`` tells that the planned joint angles changed since the newest message before.
    """

    number: int
    device_time_s: float
    pose: Pose
    joints: Joints
    planned_joints: Joints
    host_time_ns: int
    moving: bool = False


class PositionStream:
    """Receiver of one controller's position stream."""

    def __init__(self, settings: EGMSettings) -> None:
        self._settings = settings
        self._socket: StampedSocket | None = None
        self._peer: str | None = None
        self._controller: tuple[str, int] | None = None
        self._account = SequenceAccount()
        self._newest: EGMSample | None = None
        self._newest_message: EgmRobot | None = None

    def open(self) -> None:
        """Listen.

        Raises
        ------
        ConfigurationError
            When the port cannot be had, or datagrams from elsewhere would be taken from anybody.
        DeviceUnreachableError
            When the controller's name has no address.
        """
        self._peer = _resolve(self._settings.controller_address)
        self._socket = StampedSocket(_interface(self._settings.bind_address, self._peer), self._settings.port)

    @property
    def port(self) -> int:
        """The UDP port it listens on."""
        return self._opened().port

    @property
    def newest_message(self) -> EgmRobot | None:
        """The last message as it came."""
        return self._newest_message

    @property
    def newest_sample(self) -> EGMSample | None:
        """The last message in SI units."""
        return self._newest

    @property
    def generation(self) -> str:
        """What the last message tells of the controller: its layout's letter in :mod:`~robot_drivers.abb.egm.codec`."""
        return "" if self._newest_message is None else classify(self._newest_message)

    def receive(self, timeout_s: float) -> list[EGMSample]:
        """Return the samples that arrived since the last call; wait up to ``timeout_s`` for a first one."""
        deadline = time.monotonic() + timeout_s
        while datagrams := self._opened().receive(deadline - time.monotonic()):
            samples = [sample for datagram in datagrams if (sample := self._accept(datagram)) is not None]
            if samples or time.monotonic() > deadline:
                return samples
        return []

    def read(self, timeout_s: float) -> PoseBlock:
        """Return what :meth:`receive` does as one block; empty when nothing came in that time."""
        return pose_block(self.receive(timeout_s))

    def reply(self, content: bytes) -> None:
        """Send a datagram to where the controller's last one came from."""
        if self._controller is None:
            raise DeviceUnreachableError(
                "no EGM datagram has come yet, so there is no address to answer; start EGM on the controller"
            )
        self._opened().send(content, self._controller)

    def statistics(self) -> StreamStatistics:
        """Return the counts; datagrams of strangers count as malformed."""
        return self._account.statistics

    def close(self) -> None:
        """Stop listening."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _opened(self) -> StampedSocket:
        if self._socket is None:
            raise ConfigurationError("the EGM stream is closed; open it first")
        return self._socket

    def _accept(self, datagram: Datagram) -> EGMSample | None:
        try:
            if self._peer not in (None, datagram.sender[0]):
                raise DeviceProtocolError(f"datagram of a stranger, {datagram.sender[0]}")
            message = decode_robot(datagram.content)
            sample = to_sample(message, datagram.host_time_ns, self._settings.untimed_joint_unit)
        except DeviceProtocolError:
            self._account.malformed()
            return None
        self._peer, self._controller = datagram.sender[0], datagram.sender
        counter = self._account.accept(sample.number, sample.device_time_s)
        if counter is None:
            return None
        sample = replace(sample, number=counter, moving=_turns(self._newest, sample))
        if self._newest is None or counter > self._newest.number:
            self._newest, self._newest_message = sample, message
        return sample


def pose_block(samples: list[EGMSample]) -> PoseBlock:
    """Return samples as one block."""
    n = len(samples)
    return PoseBlock(
        counter=np.array([s.number for s in samples], np.int64),
        device_time_s=np.array([s.device_time_s for s in samples]),
        host_time_ns=np.array([s.host_time_ns for s in samples], np.int64),
        position=np.array([s.pose.position for s in samples]).reshape(n, 3),
        quaternion_wxyz=np.array([s.pose.quaternion_wxyz for s in samples]).reshape(n, 4),
        joints=np.array([s.joints for s in samples]).reshape(n, 6),
        moving=np.array([s.moving for s in samples], np.bool_),
    )


def to_sample(message: EgmRobot, host_time_ns: int, untimed_joint_unit: Literal["rad", "deg"]) -> EGMSample:
    """Return the SI sample of a message.

    The clock is that of the measurement; where a message has none (RobotWare up to 6.06), its send time.

    Raises
    ------
    DeviceProtocolError
        When the message lacks header, pose or joints, or holds a number that is not finite.
    """
    header, measured = message.header, message.feed_back
    if header is None or header.seqno is None or measured is None:
        raise DeviceProtocolError("EGM message without sequence number or feedback")
    if measured.time is not None:
        device_time_s = measured.time.sec + 1e-6 * measured.time.usec
    elif header.tm is not None:
        device_time_s = 1e-3 * header.tm
    else:
        raise DeviceProtocolError("EGM message without any time")
    unit = math.radians(1.0) if measured.time is not None or untimed_joint_unit == "deg" else 1.0
    joints = _joints(measured, unit)
    planned = joints if message.planned is None else _joints(message.planned, unit)
    return EGMSample(header.seqno, device_time_s, _pose(measured), joints, planned, host_time_ns)


def classify(message: EgmRobot) -> str:
    """Return the generation of a message, as far as it shows: "A", "B", "B'", "C" or "D"."""
    if message.torque_ref is not None or (message.feed_back is not None and message.feed_back.time_stamp):
        return "D"
    if message.feed_back is None or message.feed_back.time is None:
        return "A"
    if isinstance(message.measured_force, EgmMeasuredForce) or message.move_index is not None:
        return "C"
    return "B" if message.utilization_rate is None else "B'"


def _turns(before: EGMSample | None, sample: EGMSample) -> bool:
    if before is None or sample.device_time_s <= before.device_time_s:
        return False
    turn = max(abs(a - b) for a, b in zip(sample.planned_joints, before.planned_joints, strict=True))
    return turn > _STANDING_RAD_S * (sample.device_time_s - before.device_time_s)


def _pose(motion: EgmMotion) -> Pose:
    cartesian = motion.cartesian
    if cartesian is None or cartesian.pos is None or cartesian.orient is None:
        raise DeviceProtocolError("EGM message without position or quaternion")
    p, q = cartesian.pos, cartesian.orient
    numbers = (p.x, p.y, p.z, q.u0, q.u1, q.u2, q.u3)
    if not all(map(math.isfinite, numbers)) or abs(math.hypot(*numbers[3:]) - 1) > _QUATERNION_TOLERANCE:
        raise DeviceProtocolError(f"EGM message with {numbers} as position and quaternion")
    position = (p.x * _METRES_PER_MM, p.y * _METRES_PER_MM, p.z * _METRES_PER_MM)
    return Pose(position, (q.u0, q.u1, q.u2, q.u3))


def _joints(motion: EgmMotion, unit: float) -> Joints:
    angles = () if motion.joints is None else motion.joints.joints
    if len(angles) != 6 or not all(map(math.isfinite, angles)):
        raise DeviceProtocolError(f"EGM message with joints {angles} instead of six numbers")
    q1, q2, q3, q4, q5, q6 = (unit * angle for angle in angles)
    return q1, q2, q3, q4, q5, q6


def _interface(bind_address: str | None, peer: str | None) -> str:
    """Return the address to listen on."""
    if bind_address is None:
        if peer is None:
            return LOOPBACK
        try:
            return address_towards(peer)
        except OSError as error:
            raise DeviceUnreachableError(
                f"no network leads to the EGM controller {peer} ({error.strerror}): check cable and network"
            ) from error
    if peer is None and not is_loopback(bind_address):
        raise ConfigurationError(
            f"EGM would listen on {bind_address} to whoever sends first; name the controller in controller_address"
        )
    return bind_address


def _resolve(host: str | None) -> str | None:
    if host is None:
        return None
    try:
        return socket.gethostbyname(host)
    except OSError as error:
        raise DeviceUnreachableError(
            f"the EGM controller address {host!r} is not known ({error}); check it"
        ) from error
