"""What a motion may not exceed, checked along the whole path before its first step."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from robot_drivers.abb.motion import kinematics
from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.errors import MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.motion.checks import Box, check_speed, check_step, check_workspace
from robot_drivers.protocols import Pose, Speed

_SAMPLE_LENGTH = 0.002  # m
_SAMPLE_ANGLE = math.radians(1.0)
_CONFIGURATION_JUMP = math.radians(30.0)  # between two samples: the arm would swing over to another solution


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Bounds of every motion; a request beyond one is refused, never clamped. SI units.

    Attributes
    ----------
    linear_speed, angular_speed : of the tool, m/s and rad/s
    step_length, step_angle : of one linear motion, m and rad
    workspace : where the origin of the tool frame may be, base frame
    joint_limits : six (lower, upper), rad
    minimum_wrist_angle : smallest distance of axis 5 from the wrist singularity, rad
    path_deviation : how far from its straight line the tool may be seen while it moves, m
    """

    linear_speed: float = 0.05
    angular_speed: float = math.radians(30.0)
    step_length: float = 0.02
    step_angle: float = math.radians(15.0)
    workspace: Box = field(default_factory=lambda: Box((0.25, -0.35, 0.02), (0.70, 0.35, 0.70)))
    joint_limits: tuple[tuple[float, float], ...] = kinematics.JOINT_LIMITS
    minimum_wrist_angle: float = math.radians(10.0)
    path_deviation: float = 0.002


def check_trajectory(
    limits: MotionLimits,
    start: Pose,
    start_joints: Joints,
    targets: Sequence[Pose],
    speed: Speed,
    T_flange_tool: Pose = poses.IDENTITY,
) -> list[Joints]:
    """Follow straight lines through ``targets`` in thought and refuse all of them if one breaks a limit.

    The path is sampled every 2 mm or 1°: straight in position, slerp in orientation, with the joint angles
    that continue ``start_joints``.

    Parameters
    ----------
    start, targets : ``T_base_tool`` before the first step and after each
    start_joints : joint angles at ``start``, rad; they tell the configuration of the arm
    T_flange_tool : the controller's tool data

    Returns
    -------
    The joint angles at each target, rad.

    Raises
    ------
    MotionRefusedError
        Naming the step (from 1) and the axis or limit; nothing has moved.
    """
    check_speed(limits, speed)
    T_tool_flange = poses.inverse(T_flange_tool)
    joints = _joints_of_start(poses.compose(start, T_tool_flange), start_joints)
    reached, pose = [], start
    for number, target in enumerate(targets, start=1):
        try:
            joints = _check_step(limits, pose, joints, target, speed, T_tool_flange)
        except MotionRefusedError as refusal:
            raise MotionRefusedError(
                f"step {number} of {len(targets)} refused, nothing has moved: {refusal}"
            ) from None
        reached.append(joints)
        pose = target
    return reached


def _check_step(
    limits: MotionLimits, start: Pose, joints: Joints, target: Pose, speed: Speed, T_tool_flange: Pose
) -> Joints:
    check_step(limits, start, target)
    length, angle = poses.distance(start, target)
    samples = max(1, math.ceil(length / _SAMPLE_LENGTH), math.ceil(angle / _SAMPLE_ANGLE))
    sample_time = max(length / speed.linear, angle / speed.angular) / samples
    for sample in range(1, samples + 1):
        pose = poses.interpolate(start, target, sample / samples)
        check_workspace(limits.workspace, pose)
        following = kinematics.inverse_continuous(poses.compose(pose, T_tool_flange), joints)
        _check_joints(limits, following)
        _check_joint_motion(joints, following, sample_time)
        joints = following
    return joints


def _joints_of_start(T_base_flange: Pose, reported: Joints) -> Joints:
    """Return the joints that belong to the start, free of the rounding with which a controller reports them."""
    joints = kinematics.inverse_continuous(T_base_flange, reported)
    if max(abs(a - b) for a, b in zip(joints, reported, strict=True)) > _CONFIGURATION_JUMP:
        raise MotionRefusedError("the joints reported do not belong to the pose reported; nothing has moved")
    return joints


def _check_joints(limits: MotionLimits, joints: Joints) -> None:
    for axis, (value, (low, high)) in enumerate(zip(joints, limits.joint_limits, strict=True), start=1):
        if not low <= value <= high:
            raise MotionRefusedError(
                f"axis {axis} would come to {math.degrees(value):.2f}°, "
                f"its range is {math.degrees(low):.0f} .. {math.degrees(high):.0f}°"
            )
    wrist = kinematics.singularity_angle(joints)
    if wrist < limits.minimum_wrist_angle:
        raise MotionRefusedError(
            f"axis 5 would come within {math.degrees(wrist):.2f}° of the wrist singularity, "
            f"the limit is {math.degrees(limits.minimum_wrist_angle):.2f}°"
        )


def _check_joint_motion(joints: Joints, following: Joints, duration: float) -> None:
    for axis, (before, after, limit) in enumerate(
        zip(joints, following, kinematics.JOINT_SPEEDS, strict=True), start=1
    ):
        turn = abs(after - before)
        if turn > _CONFIGURATION_JUMP:
            raise MotionRefusedError(f"axis {axis} would swing over to another configuration of the arm")
        if turn > limit * duration:
            raise MotionRefusedError(
                f"axis {axis} would need {math.degrees(turn / duration):.0f} °/s, "
                f"its limit is {math.degrees(limit):.0f} °/s"
            )
