"""What a motion of the arm may not exceed: checked along the whole path before its first step, and while it moves."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from robot_drivers.errors import DeviceFaultError, MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.motion.checks import Box, check_speed, check_step, check_workspace
from robot_drivers.protocols import Pose, Speed
from robot_drivers.universal_robots.arms import FULL_TURN, JOINT_SPEED, Joints, Lengths
from robot_drivers.universal_robots.robot.kinematics import continued, flange_pose

_SAMPLE_LENGTH = 0.002  # m
_SAMPLE_ANGLE = math.radians(1.0)


@dataclass(frozen=True, slots=True)
class URLimits:
    """Bounds of every motion; a request beyond one is refused, never clamped. SI units.

    Attributes
    ----------
    linear_speed, angular_speed : of the tool, m/s and rad/s
    step_length, step_angle : of one linear motion, m and rad
    workspace : where the origin of the tool frame may be, base frame
    joint_limits : (lower, upper) of the six joints, rad
    joint_speed : of any joint on the way, rad/s; near a singularity they would have to be faster
    path_deviation : how far from its straight line the tool may be seen while it moves, m
    """

    linear_speed: float = 0.05
    angular_speed: float = math.radians(30.0)
    step_length: float = 0.02
    step_angle: float = math.radians(15.0)
    workspace: Box = field(default_factory=lambda: Box((-0.85, -0.85, 0.02), (0.85, 0.85, 0.90)))
    joint_limits: tuple[tuple[float, float], ...] = ((-FULL_TURN, FULL_TURN),) * 6
    joint_speed: float = JOINT_SPEED
    path_deviation: float = 0.002

    def __post_init__(self) -> None:
        if len(self.joint_limits) != 6 or not all(low < high for low, high in self.joint_limits):
            raise ValueError("joint_limits must be six pairs, the lower one first")


def check_path(
    limits: URLimits, lengths: Lengths, start: tuple[Pose, Joints], targets: Sequence[Pose], speed: Speed
) -> None:
    """Follow straight lines through ``targets`` in thought and refuse all of them if one breaks a limit.

    Parameters
    ----------
    start : ``T_base_tool`` and the joint angles at it, as the controller tells both
    targets : ``T_base_tool`` after each step

    Raises
    ------
    MotionRefusedError
        Naming the step (from 1) and the axis or limit; nothing has moved.
    """
    check_speed(limits, speed)
    pose, joints = start
    T_tool_flange = poses.compose(poses.inverse(pose), flange_pose(lengths, joints))
    for number, target in enumerate(targets, start=1):
        try:
            check_step(limits, pose, target)
            joints = _followed(limits, lengths, (pose, joints), target, speed, T_tool_flange)
        except MotionRefusedError as refusal:
            raise MotionRefusedError(
                f"step {number} of {len(targets)} refused, nothing has moved: {refusal}"
            ) from None
        pose = target


def check_joints(limits: URLimits, joints: Joints) -> None:
    """Check the angles that an arm under way tells.

    Raises
    ------
    DeviceFaultError
        One is beyond its end.
    """
    if (told := _beyond(limits, joints)) is not None:
        raise DeviceFaultError(told)


def _followed(
    limits: URLimits,
    lengths: Lengths,
    start: tuple[Pose, Joints],
    target: Pose,
    speed: Speed,
    T_tool_flange: Pose,
) -> Joints:
    pose, joints = start
    length, angle = poses.distance(pose, target)
    samples = max(1, math.ceil(length / _SAMPLE_LENGTH), math.ceil(angle / _SAMPLE_ANGLE))
    sample_s = max(length / speed.linear, angle / speed.angular) / samples
    for sample in range(1, samples + 1):
        on_way = poses.interpolate(pose, target, sample / samples)
        check_workspace(limits.workspace, on_way)
        following = continued(lengths, poses.compose(on_way, T_tool_flange), joints)
        if (told := _beyond(limits, following)) is not None:
            raise MotionRefusedError(told)
        for axis, (before, after) in enumerate(zip(joints, following, strict=True), start=1):
            if abs(after - before) > limits.joint_speed * sample_s:
                raise MotionRefusedError(
                    f"axis {axis} would need more than {math.degrees(limits.joint_speed):.0f} °/s, as next to a "
                    "singularity"
                )
        joints = following
    return joints


def _beyond(limits: URLimits, joints: Joints) -> str | None:
    for axis, (value, (low, high)) in enumerate(zip(joints, limits.joint_limits, strict=True), start=1):
        if not low <= value <= high:
            return (
                f"axis {axis} comes to {math.degrees(value):.2f}°, its range is {math.degrees(low):.0f} .. "
                f"{math.degrees(high):.0f}°"
            )
    return None
