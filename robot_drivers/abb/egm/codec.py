"""The messages of Externally Guided Motion (proto2 package ``abb.egm``), in every generation in use.

======  ============  ====================================================================================
layout  RobotWare     what it has
======  ============  ====================================================================================
A       6.00 – 6.06   no ``time``, ``measuredForce``, ``utilizationRate``; feedback joints in **radians**
B       6.07 – 6.09   + ``time``, + ``measuredForce`` with force = field 1
B'      6.10 –        + ``utilizationRate``
C       about 6.14    ``measuredForce`` renumbered (fcActive = 1, force = 2), + moveIndex, CollisionInfo,
                      RAPID data
D       7.16          + torqueRef, + timeStamp
======  ============  ====================================================================================

Units on the wire: mm, degrees (but see A), N, N·m; quaternions with the scalar first. A datagram is one
message, without framing. Field names follow the .proto in snake case.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from robot_drivers.abb.egm.protobuf import (
    VARINT,
    boolean,
    decode,
    double,
    doubles,
    first_field,
    message,
    message_by_content,
    uint,
)
from robot_drivers.errors import DeviceProtocolError

LARGEST_DATAGRAM = 4096  # four times the buffer of abb_libegm

_MOST_JOINTS = 7
_MOST_FORCES = 6
_MOST_RAPID_NUMBERS = 40
_MOST_SIGNALS = 64


class MessageType(IntEnum):
    """``EgmHeader.mtype``."""

    UNDEFINED = 0
    COMMAND = 1
    DATA = 2
    CORRECTION = 3
    PATH_CORRECTION = 4


class MotorState(IntEnum):
    """``EgmMotorState.state``."""

    UNDEFINED = 0
    ON = 1
    OFF = 2


class MciState(IntEnum):
    """``EgmMCIState.state``: of the motion correction."""

    UNDEFINED = 0
    ERROR = 1
    STOPPED = 2
    RUNNING = 3


class RapidState(IntEnum):
    """``EgmRapidCtrlExecState.state``; it can stay UNDEFINED after a restart although RAPID runs."""

    UNDEFINED = 0
    STOPPED = 1
    RUNNING = 2


@dataclass(frozen=True, slots=True)
class EgmHeader:
    """Sequence number and send time (ms, wraps after 49.7 days) of a message."""

    seqno: Annotated[int | None, uint(1)] = None
    tm: Annotated[int | None, uint(2)] = None
    mtype: Annotated[int | None, uint(3)] = None


@dataclass(frozen=True, slots=True)
class EgmCartesian:
    """A position, mm."""

    x: Annotated[float, double(1)]
    y: Annotated[float, double(2)]
    z: Annotated[float, double(3)]


@dataclass(frozen=True, slots=True)
class EgmQuaternion:
    """An orientation, u0 the scalar."""

    u0: Annotated[float, double(1)]
    u1: Annotated[float, double(2)]
    u2: Annotated[float, double(3)]
    u3: Annotated[float, double(4)]


@dataclass(frozen=True, slots=True)
class EgmEuler:
    """An orientation, degrees, ZYX; the controller prefers it to a quaternion beside it."""

    x: Annotated[float, double(1)]
    y: Annotated[float, double(2)]
    z: Annotated[float, double(3)]


@dataclass(frozen=True, slots=True)
class EgmClock:
    """Time of a sample on the controller's clock, s and µs; µs may run past a million."""

    sec: Annotated[int, uint(1)]
    usec: Annotated[int, uint(2)]


@dataclass(frozen=True, slots=True)
class EgmTimestamp:
    """IEEE 1588 time of a sample, s and ns."""

    sec: Annotated[int | None, uint(1)] = None
    nsec: Annotated[int | None, uint(2)] = None


@dataclass(frozen=True, slots=True)
class EgmPose:
    """Position and orientation of the tool."""

    pos: Annotated[EgmCartesian | None, message(1, EgmCartesian)] = None
    orient: Annotated[EgmQuaternion | None, message(2, EgmQuaternion)] = None
    euler: Annotated[EgmEuler | None, message(3, EgmEuler)] = None


@dataclass(frozen=True, slots=True)
class EgmCartesianSpeed:
    """Six speeds: mm/s, mm/s, mm/s, °/s, °/s, °/s."""

    value: Annotated[tuple[float, ...], doubles(1, _MOST_JOINTS)] = ()


@dataclass(frozen=True, slots=True)
class EgmJoints:
    """Joint angles (or speeds), degrees."""

    joints: Annotated[tuple[float, ...], doubles(1, _MOST_JOINTS)] = ()


@dataclass(frozen=True, slots=True)
class EgmMotion:
    """``EgmFeedBack`` and ``EgmPlanned``, which have the same fields."""

    joints: Annotated[EgmJoints | None, message(1, EgmJoints)] = None
    cartesian: Annotated[EgmPose | None, message(2, EgmPose)] = None
    external_joints: Annotated[EgmJoints | None, message(3, EgmJoints)] = None
    time: Annotated[EgmClock | None, message(4, EgmClock)] = None
    time_stamp: Annotated[EgmTimestamp | None, message(5, EgmTimestamp)] = None


@dataclass(frozen=True, slots=True)
class EgmSpeedRef:
    """Speed references of a command."""

    joints: Annotated[EgmJoints | None, message(1, EgmJoints)] = None
    cartesians: Annotated[EgmCartesianSpeed | None, message(2, EgmCartesianSpeed)] = None
    external_joints: Annotated[EgmJoints | None, message(3, EgmJoints)] = None


@dataclass(frozen=True, slots=True)
class EgmState:
    """``EgmMotorState``, ``EgmMCIState`` and ``EgmRapidCtrlExecState``."""

    state: Annotated[int, uint(1)]


@dataclass(frozen=True, slots=True)
class EgmTestSignals:
    """Signals for ABB's own use."""

    signals: Annotated[tuple[float, ...], doubles(1, _MOST_SIGNALS)] = ()


@dataclass(frozen=True, slots=True)
class EgmMeasuredForceB:
    """Measured force of generation B, N and N·m."""

    force: Annotated[tuple[float, ...], doubles(1, _MOST_FORCES)] = ()


@dataclass(frozen=True, slots=True)
class EgmMeasuredForce:
    """Measured force of generations C and D, N and N·m; raw where force control is not active."""

    fc_active: Annotated[bool | None, boolean(1)] = None
    force: Annotated[tuple[float, ...], doubles(2, _MOST_FORCES)] = ()


@dataclass(frozen=True, slots=True)
class EgmCollisionInfo:
    """Collision detection."""

    collision_triggered: Annotated[bool | None, boolean(1)] = None
    coll_det_quota: Annotated[tuple[float, ...], doubles(2, _MOST_JOINTS)] = ()


@dataclass(frozen=True, slots=True)
class EgmRapidData:
    """Numbers exchanged with the RAPID program."""

    dig_val: Annotated[bool | None, boolean(1)] = None
    dnum: Annotated[tuple[float, ...], doubles(2, _MOST_RAPID_NUMBERS)] = ()


def _measured_force_layout(content: bytes) -> type[EgmMeasuredForceB] | type[EgmMeasuredForce]:
    """Tell B from C by field 1: the force itself, or the varint fcActive (which C may leave out)."""
    first = first_field(content)
    is_b = first is not None and first[0] == 1 and first[1] != VARINT
    return EgmMeasuredForceB if is_b else EgmMeasuredForce


@dataclass(frozen=True, slots=True)
class EgmRobot:
    """What the controller sends."""

    header: Annotated[EgmHeader | None, message(1, EgmHeader)] = None
    feed_back: Annotated[EgmMotion | None, message(2, EgmMotion)] = None
    planned: Annotated[EgmMotion | None, message(3, EgmMotion)] = None
    motor_state: Annotated[EgmState | None, message(4, EgmState)] = None
    mci_state: Annotated[EgmState | None, message(5, EgmState)] = None
    mci_convergence_met: Annotated[bool | None, boolean(6)] = None
    test_signals: Annotated[EgmTestSignals | None, message(7, EgmTestSignals)] = None
    rapid_exec_state: Annotated[EgmState | None, message(8, EgmState)] = None
    measured_force: Annotated[
        EgmMeasuredForceB | EgmMeasuredForce | None, message_by_content(9, _measured_force_layout)
    ] = None
    utilization_rate: Annotated[float | None, double(10)] = None
    move_index: Annotated[int | None, uint(11)] = None
    collision_info: Annotated[EgmCollisionInfo | None, message(12, EgmCollisionInfo)] = None
    rapid_from_robot: Annotated[EgmRapidData | None, message(13, EgmRapidData)] = None
    torque_ref: Annotated[EgmJoints | None, message(14, EgmJoints)] = None


@dataclass(frozen=True, slots=True)
class EgmSensor:
    """What the PC sends to guide the robot."""

    header: Annotated[EgmHeader | None, message(1, EgmHeader)] = None
    planned: Annotated[EgmMotion | None, message(2, EgmMotion)] = None
    speed_ref: Annotated[EgmSpeedRef | None, message(3, EgmSpeedRef)] = None
    rapid_to_robot: Annotated[EgmRapidData | None, message(4, EgmRapidData)] = None


def decode_robot(datagram: bytes) -> EgmRobot:
    """Read a datagram of the controller; raises DeviceProtocolError for anything malformed."""
    _check_size(datagram)
    return decode(EgmRobot, datagram)


def decode_sensor(datagram: bytes) -> EgmSensor:
    """Read a datagram of the PC; raises DeviceProtocolError for anything malformed."""
    _check_size(datagram)
    return decode(EgmSensor, datagram)


def _check_size(datagram: bytes) -> None:
    if not 0 < len(datagram) <= LARGEST_DATAGRAM:
        raise DeviceProtocolError(f"EGM datagram of {len(datagram)} bytes; 1 to {LARGEST_DATAGRAM} expected")
