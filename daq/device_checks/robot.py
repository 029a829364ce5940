"""Is a robot fit for a session? Its state, its joints, and whether the gripper is in the workspace."""

import math

import numpy as np

from daq.device_checks.report import Check
from daq.device_checks.streams import collected, counting_rate_hz, identity_check, losses_check, rate_check
from daq.frames import compose, inverse
from daq.rig import Rig
from robot_drivers.protocols import Robot
from robot_drivers.specification import RobotSpecification

_SMALLEST_JOINT_MARGIN_RAD = math.radians(5.0)


def check_robot(robot: Robot, rig: Rig, seconds: float) -> list[Check]:
    """Check a connected robot, and look for so many seconds at the poses that come."""
    blocks = collected(robot.read, seconds)
    state = robot.state()
    told = [word for word, there in (("motors on", state.motors_on), ("moving", state.moving)) if there]
    checks = [
        identity_check(robot.identity),
        Check("state", state.ready and not state.moving, ", ".join([*told, state.message or "ready"])),
    ]
    if not blocks:
        checks.append(Check("rate", False, f"no pose came in {seconds:g} s; check its state stream or EGM"))
    else:
        checks += [rate_check(counting_rate_hz(blocks), None), losses_check(robot.statistics())]
    checks.append(_joint_check(state.joints, rig.robot_specification()))
    T_tissue_base = inverse(rig.frames.T_base_tissue.pose)
    gripper = compose(compose(T_tissue_base, state.T_base_tool), rig.frames.T_tool_gripper.pose).position
    inside = bool(rig.limits.workspace.contains(gripper))
    place = " ".join(f"{1e3 * p:.1f}" for p in gripper)
    where = "inside" if inside else "outside"
    checks.append(Check("workspace", inside, f"gripper at {place} mm of the tissue frame, {where} its box"))
    return checks


def _joint_check(joints: tuple[float, ...], robot: RobotSpecification) -> Check:
    if len(joints) != robot.joints:
        return Check("joints", False, f"{len(joints)} angles are told, the driver says {robot.joints} joints")
    if (limits := robot.joint_limits) is None:
        return Check("joints", True, f"{len(joints)} joints, of whose ends the driver says nothing")
    margins = [min(q - low, high - q) for q, (low, high) in zip(joints, limits, strict=True)]
    axis = int(np.argmin(margins))
    told = f"axis {axis + 1} is {math.degrees(margins[axis]):.1f}° from its end"
    passed = margins[axis] >= _SMALLEST_JOINT_MARGIN_RAD
    if not passed:
        told += f", at least {math.degrees(_SMALLEST_JOINT_MARGIN_RAD):.0f}° expected: jog it away"
    return Check("joints", passed, told)
