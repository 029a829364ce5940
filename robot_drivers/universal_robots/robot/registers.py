"""What driver and servo program tell each other in the registers of the controller.

Registers 24 to 47 are those that RTDE clients may use; the lower ones belong to fieldbuses. The program is
``script/retract_servo.script``, which says the same in URScript.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from robot_drivers.motion import poses
from robot_drivers.protocols import Pose
from robot_drivers.universal_robots.rtde.packages import Value
from robot_drivers.universal_robots.rtde.stream import TIMESTAMP

PROGRAM_VERSION = 4101
"""What the program shows while it runs; the controller shows 0 where it does not."""

MOST_SILENT_CYCLES = 50
"""Cycles of 2 ms without a new beat after which the program brakes by itself."""
LARGEST_JUMP_M = 0.005
"""Between two references, and between the first one and the arm: beyond it the program brakes."""

_POSE = tuple(f"double_register_{number}" for number in range(24, 30))
INPUTS = ("input_int_register_24", "input_int_register_25", *(f"input_{name}" for name in _POSE))
OUTPUTS = (
    TIMESTAMP,
    "actual_q",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "robot_mode",
    "safety_mode",
    "runtime_state",
    "output_int_register_24",
    "output_int_register_25",
    "output_int_register_26",
    *(f"output_{name}" for name in _POSE),
)
ROBOT_MODE_RUNNING, SAFETY_NORMAL, SAFETY_REDUCED, RUNTIME_PLAYING = 7, 1, 2, 2
_STILL_M_S, _STILL_RAD_S = 5e-4, 5e-3


class Order(IntEnum):
    """What the driver asks for."""

    STAND = 0
    FOLLOW = 1


class Doing(IntEnum):
    """What the program does."""

    STANDING = 0
    FOLLOWING = 1
    SILENCE = 2
    JUMP = 3


@dataclass(frozen=True, slots=True)
class Told:
    """What one sample says of the arm and of the program; SI units.

    Attributes
    ----------
    T_base_tool, joints : where it is
    moving : whether the tool does
    powered : whether the arm is switched on and its brakes are off
    safe : whether no safety function has stopped it
    version, doing, beat : of the program; version 0 where it does not run
    T_flange_tool : the tool centre point of the installation, as the program tells it
    """

    T_base_tool: Pose
    joints: tuple[float, float, float, float, float, float]
    moving: bool
    powered: bool
    safe: bool
    version: int
    doing: int
    beat: int
    T_flange_tool: Pose

    @classmethod
    def by(cls, values: Mapping[str, Value]) -> "Told":
        """Return what the values of :data:`OUTPUTS` say."""
        numbers = {name: value for name, value in values.items() if not isinstance(value, tuple)}
        q1, q2, q3, q4, q5, q6 = _vector(values, "actual_q")
        vx, vy, vz, wx, wy, wz = _vector(values, "actual_TCP_speed")
        playing = numbers["runtime_state"] == RUNTIME_PLAYING
        tcp = tuple(float(numbers[f"output_{name}"]) for name in _POSE)
        return cls(
            T_base_tool=pose_of(_vector(values, "actual_TCP_pose")),
            joints=(q1, q2, q3, q4, q5, q6),
            moving=max(abs(vx), abs(vy), abs(vz)) > _STILL_M_S
            or max(abs(wx), abs(wy), abs(wz)) > _STILL_RAD_S,
            powered=numbers["robot_mode"] == ROBOT_MODE_RUNNING,
            safe=numbers["safety_mode"] in (SAFETY_NORMAL, SAFETY_REDUCED),
            version=int(numbers["output_int_register_24"]) if playing else 0,
            doing=int(numbers["output_int_register_25"]),
            beat=int(numbers["output_int_register_26"]),
            T_flange_tool=pose_of(tcp),
        )

    @property
    def trouble(self) -> str:
        """Why the arm would not follow a reference; empty where it would."""
        if not self.safe:
            return "a safety function has stopped the arm; unlock it at the teach pendant"
        if not self.powered:
            return "the arm is off, or its brakes are on; switch it on at the teach pendant"
        if self.version == 0:
            return "the servo program does not run; start retract_servo.script at the teach pendant"
        if self.version != PROGRAM_VERSION:
            return (
                f"the servo program is of version {self.version}, not {PROGRAM_VERSION}; load this driver's"
            )
        return ""


def pose_of(vector: tuple[float, ...]) -> Pose:
    """Return a pose of the controller, position and rotation vector, as a pose."""
    x, y, z, rx, ry, rz = vector
    return Pose((x, y, z), poses.from_rotation_vector((rx, ry, rz)))


def vector_of(pose: Pose) -> tuple[float, float, float, float, float, float]:
    """Return a pose as the controller writes it: position, m, and rotation vector, rad."""
    return (*pose.position, *poses.rotation_vector(pose.quaternion_wxyz))


def _vector(values: Mapping[str, Value], name: str) -> tuple[float, ...]:
    value = values[name]
    assert isinstance(value, tuple)  # by its type, VECTOR6D
    return value
