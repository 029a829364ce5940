"""What a tool's path may not exceed, whatever the arm."""

import math
from dataclasses import dataclass
from typing import Protocol

from robot_drivers.errors import ConfigurationError, DeviceFaultError, MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose, Speed

_QUATERNION_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class Box:
    """A box along the axes of the base frame, m."""

    lower: poses.Vector
    upper: poses.Vector

    def __post_init__(self) -> None:
        if not all(low < high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ConfigurationError(
                f"box {self.lower} .. {self.upper} m is empty; put the smaller corner first"
            )


class PathLimits(Protocol):
    """Bounds of every motion, SI units."""

    @property
    def linear_speed(self) -> float:
        """Of the tool, m/s."""

    @property
    def angular_speed(self) -> float:
        """Of the tool, rad/s."""

    @property
    def step_length(self) -> float:
        """Of one straight line, m."""

    @property
    def step_angle(self) -> float:
        """Of one straight line, rad."""

    @property
    def path_deviation(self) -> float:
        """How far from its straight line the tool may be seen while it moves, m."""


def check_speed(limits: PathLimits, speed: Speed) -> None:
    """Raise MotionRefusedError unless a speed is above 0 and within the limits."""
    for kind, value, limit, unit in (
        ("linear", speed.linear, limits.linear_speed, "m/s"),
        ("angular", speed.angular, limits.angular_speed, "rad/s"),
    ):
        if not 0 < value <= limit:
            raise MotionRefusedError(
                f"{kind} speed {value:g} {unit} is not above 0 and at most the limit of {limit:g} {unit}"
            )


def check_step(limits: PathLimits, start: Pose, target: Pose) -> None:
    """Raise MotionRefusedError where a straight line is too long, turns too far, or leads to no pose."""
    _check_pose(target)
    length, angle = poses.distance(start, target)
    if length > limits.step_length:
        raise MotionRefusedError(
            f"it is {length * 1e3:.2f} mm long, the limit is {limits.step_length * 1e3:.2f} mm"
        )
    if angle > limits.step_angle:
        raise MotionRefusedError(
            f"it turns by {math.degrees(angle):.2f}°, the limit is {math.degrees(limits.step_angle):.2f}°"
        )


def check_on_line(limits: PathLimits, start: Pose, target: Pose, present: Pose) -> None:
    """Check that a tool under way from ``start`` to ``target`` is on its straight line.

    Raises
    ------
    DeviceFaultError
        When it is not.
    """
    way = [b - a for a, b in zip(start.position, target.position, strict=True)]
    done = [p - a for a, p in zip(start.position, present.position, strict=True)]
    squared_length = sum(w * w for w in way)
    fraction = sum(w * d for w, d in zip(way, done, strict=True)) / squared_length if squared_length else 0.0
    nearest = poses.interpolate(start, target, min(max(fraction, 0.0), 1.0))
    deviation, _ = poses.distance(nearest, present)
    if deviation > limits.path_deviation:
        raise DeviceFaultError(
            f"the tool is {deviation * 1e3:.2f} mm off its straight line, "
            f"the limit is {limits.path_deviation * 1e3:.2f} mm"
        )


def check_workspace(box: Box, pose: Pose) -> None:
    """Raise MotionRefusedError where the origin of a pose lies outside the box."""
    for axis, value, low, high in zip("xyz", pose.position, box.lower, box.upper, strict=True):
        if not low <= value <= high:
            raise MotionRefusedError(
                f"the tool would come to {axis} = {value:.4f} m, the workspace is {low:.4f} .. {high:.4f} m"
            )


def _check_pose(target: Pose) -> None:
    numbers = (*target.position, *target.quaternion_wxyz)
    if not all(map(math.isfinite, numbers)):
        raise MotionRefusedError(f"its target {numbers} is not a pose of finite numbers")
    norm = math.hypot(*target.quaternion_wxyz)
    if abs(norm - 1) > _QUATERNION_TOLERANCE:
        raise MotionRefusedError(f"the quaternion {target.quaternion_wxyz} has length {norm:.4f}, not 1")
