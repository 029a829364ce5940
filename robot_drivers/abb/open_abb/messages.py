"""The text messages of the open-abb protocol: requests to its RAPID server, replies from it.

A request is ``code parameters #`` with single blanks and no line end; a reply is ``code ok payload`` without any mark
at its end. The server reads at most 80 characters. Lengths in mm, angles in degrees, quaternions with the scalar
first. Source: ``SERVER.mod`` and ``abb.py`` of the open-abb-driver project, whose client sends one decimal of a length.
"""

import math
import re
from dataclasses import dataclass
from enum import IntEnum

from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.decimal_text import decimal
from robot_drivers.errors import ConfigurationError, DeviceProtocolError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose, Speed

LONGEST_MESSAGE = 80
"""Characters that RAPID's SocketReceive takes into one string."""

_REPLY = re.compile(r"(\d{1,2}) ([01]) (.*)")
_INFO = re.compile(r"98 1 ([^*]*\*[^*]*\*[^*]*)$")
_QUATERNION_TOLERANCE = 5e-3  # the server rounds to three decimals


class Code(IntEnum):
    """What a request asks for."""

    PING = 0
    MOVE_LINEAR = 1
    POSE = 3
    JOINTS = 4
    TOOL = 6
    WORK_OBJECT = 7
    SPEED = 8
    ZONE = 9
    INFO = 98
    CLOSE = 99


@dataclass(frozen=True, slots=True)
class Reply:
    """A reply; ``ok`` is False when the server did not understand the request and did nothing."""

    code: int
    ok: bool
    payload: str


def request(code: Code, *parameters: str) -> bytes:
    """Return a request; raises ConfigurationError where it is longer than the server reads."""
    text = " ".join((f"{code:02d}", *parameters, "#"))
    if len(text) > LONGEST_MESSAGE:
        raise ConfigurationError(
            f"the open-abb request {text!r} has {len(text)} characters, the server reads {LONGEST_MESSAGE}; "
            "use fewer decimals"
        )
    return text.encode("ascii")


def pose_parameters(pose: Pose, decimals: int) -> tuple[str, ...]:
    """Return a pose as parameters, the position in mm with this many decimals."""
    position = (f"{1e3 * value:+08.{decimals}f}" for value in pose.position)
    return (*position, *(f"{value:+08.5f}" for value in pose.quaternion_wxyz))


def speed_parameters(speed: Speed, decimals: int) -> tuple[str, ...]:
    """Return a speed as parameters, mm/s with this many decimals and °/s with one more.

    The external axes, which do not move, get the same numbers.

    Raises
    ------
    ConfigurationError
        The speed would be rounded to zero.
    """
    linear = f"{1e3 * speed.linear:+08.{decimals}f}"
    angular = f"{math.degrees(speed.angular):+08.{decimals + 1}f}"
    if not (float(linear) > 0 and float(angular) > 0):
        raise ConfigurationError(f"{speed} rounds to zero with {decimals} decimals of mm/s; use more of them")
    return linear, angular, linear, angular


def fine_zone_parameters() -> tuple[str, ...]:
    """Return the zone of a stop point, with which a motion is acknowledged on arrival."""
    return "1", *(f"{0.0:+08.4f}" for _ in range(3))


def parse_reply(received: bytes) -> Reply:
    """Parse one whole reply.

    Raises
    ------
    DeviceProtocolError
        It is none.
    """
    match = _REPLY.fullmatch(received.decode("ascii", errors="replace"))
    if match is None:
        raise DeviceProtocolError(f"{received!r} is no reply of an open-abb server; is one loaded?")
    return Reply(int(match[1]), match[2] == "1", match[3].strip())


def find_info(received: bytes) -> str | None:
    """Return the payload of an INFO reply at the end of what has come; None without one.

    What stands before it is the acknowledgement of a request of an earlier client, which the server delivers to the
    next one when its own was lost.
    """
    match = _INFO.search(received.decode("ascii", errors="replace"))
    return None if match is None else match[1]


def parse_pose(payload: str) -> Pose:
    """Parse a pose, which has steps of 0.01 mm and of 0.001 in the quaternion (0.1°).

    Raises
    ------
    DeviceProtocolError
        There are not seven finite numbers, or four of them are no rotation.
    """
    x, y, z, *quaternion = _numbers(payload, 7)
    q1, q2, q3, q4 = quaternion
    if abs(math.hypot(*quaternion) - 1) > _QUATERNION_TOLERANCE:
        raise DeviceProtocolError(f"the open-abb server reports {quaternion} as an orientation")
    return poses.normalised(Pose((x * 1e-3, y * 1e-3, z * 1e-3), (q1, q2, q3, q4)))


def parse_joints(payload: str) -> Joints:
    """Parse six joint angles, rad, which have steps of 0.01°; raises as :func:`parse_pose` does."""
    q1, q2, q3, q4, q5, q6 = map(math.radians, _numbers(payload, 6))
    return q1, q2, q3, q4, q5, q6


def _numbers(payload: str, count: int) -> list[float]:
    numbers = [decimal(word) for word in payload.split()]
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise DeviceProtocolError(f"the open-abb server answered {payload!r} instead of {count} numbers")
    return numbers
