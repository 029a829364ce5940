"""What is checked before anything moves."""

import math
from collections.abc import Sequence

from daq.errors import MotionLimitError, SessionError
from daq.frames import compose, distance, inverse, pose, rotation
from daq.rig import Rig
from daq.trajectories import Trajectory
from robot_drivers.protocols import Pose, RobotState

REST_TOLERANCE_M = 0.002
REST_TOLERANCE_DEG = 2.0


def require_rest(rig: Rig, state: RobotState) -> None:
    """Refuse a robot that cannot move, or that does not stand where the rig file says the tissue is grasped.

    Raises
    ------
    SessionError
        Telling what is wrong and by how much.
    """
    if state.stopped:
        raise SessionError(
            f"the robot is held ({state.message}); look at the cell, then release it and start again"
        )
    if not state.ready:
        raise SessionError(f"the robot is not ready ({state.message}); make it ready at its controller")
    grasp = Pose(rig.specimen.grasp.centre)
    length, angle = distance(grasp, gripper_in_tissue(rig, state.T_base_tool))
    if length > REST_TOLERANCE_M or math.degrees(angle) > REST_TOLERANCE_DEG:
        raise SessionError(
            f"the gripper stands {length * 1e3:.1f} mm and {math.degrees(angle):.1f}° off the grasp of the rig file "
            f"(tolerance {REST_TOLERANCE_M * 1e3:g} mm, {REST_TOLERANCE_DEG:g}°); jog it there, or correct "
            "T_base_tissue, T_tool_gripper or the grasp"
        )


def require_joints(rig: Rig, state: RobotState) -> None:
    """Refuse a robot that has other joints than its driver says.

    Raises
    ------
    SessionError
        Telling how many.
    """
    stated = rig.robot_specification().joints
    if len(state.joints) != stated:
        raise SessionError(
            f"the robot tells {len(state.joints)} joint angles, its driver {rig.robot.driver!r} says {stated}; "
            "correct the driver, or its settings in the rig file"
        )


def gripper_in_tissue(rig: Rig, T_base_tool: Pose) -> Pose:
    """Return ``T_tissue_gripper``."""
    T_tissue_tool = compose(inverse(rig.frames.T_base_tissue.pose), T_base_tool)
    return compose(T_tissue_tool, rig.frames.T_tool_gripper.pose)


def tool_targets(rig: Rig, trajectory: Trajectory, T_base_tool_rest: Pose) -> list[Pose]:
    """Return ``T_base_tool`` of every step, for the rest pose that the robot reports."""
    rest = gripper_in_tissue(rig, T_base_tool_rest)
    T_gripper_tool = inverse(rig.frames.T_tool_gripper.pose)
    targets = []
    for step in trajectory.steps:
        away = step.T_rest_gripper
        position = [start + way for start, way in zip(rest.position, away.position, strict=True)]
        orientation = rotation(away.quaternion_wxyz) * rotation(rest.quaternion_wxyz)
        T_base_gripper = compose(rig.frames.T_base_tissue.pose, pose(position, orientation))
        targets.append(compose(T_base_gripper, T_gripper_tool))
    return targets


def check_limits(rig: Rig, trajectory: Trajectory, targets: Sequence[Pose]) -> None:
    """Refuse a trajectory that leaves the rig's limits anywhere.

    Raises
    ------
    MotionLimitError
        Naming step, value and limit; nothing has moved.
    """
    limits = rig.limits
    if trajectory.speed.linear > limits.speed_m_s:
        raise MotionLimitError(
            f"{trajectory.kind}: its speed of {trajectory.speed.linear * 1e3:g} mm/s exceeds the limit of "
            f"{limits.speed_m_s * 1e3:g} mm/s; choose a slower one"
        )
    before = gripper_in_tissue(rig, targets[0])
    for step, target in zip(trajectory.steps, targets, strict=True):
        here = gripper_in_tissue(rig, target)
        length, _ = distance(before, here)
        if length > limits.step_m:
            raise MotionLimitError(
                f"{trajectory.kind}, step {step.number}: {length * 1e3:.2f} mm exceed the limit of "
                f"{limits.step_m * 1e3:g} mm; choose shorter steps"
            )
        if not bool(limits.workspace.contains(here.position)):
            where = ", ".join(f"{value * 1e3:.1f}" for value in here.position)
            raise MotionLimitError(
                f"{trajectory.kind}, step {step.number}: the gripper at ({where}) mm would leave the workspace"
            )
        before = here
