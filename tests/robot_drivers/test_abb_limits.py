"""A trajectory that breaks a limit is refused as a whole, and the refusal says where and why."""

import dataclasses
import math

import pytest

from robot_drivers.abb.motion import kinematics
from robot_drivers.abb.motion.limits import MotionLimits, check_trajectory
from robot_drivers.errors import ConfigurationError, DeviceFaultError, MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.motion.checks import Box, check_on_line
from robot_drivers.protocols import Pose, Speed

DOWN = (0.0, 0.0, 1.0, 0.0)
START = Pose((0.45, 0.0, 0.35), DOWN)
START_JOINTS = kinematics.inverse_continuous(START, near=(0.0, 0.3, 0.5, 0.0, 0.8, 0.0))
SLOW = Speed(linear=0.01, angular=0.1)
WIDE = MotionLimits(step_length=1.0, step_angle=math.pi, workspace=Box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.5)))


def check(targets, limits=None, speed=SLOW, T_flange_tool=poses.IDENTITY):
    return check_trajectory(
        limits or MotionLimits(), START, START_JOINTS, targets, speed, T_flange_tool=T_flange_tool
    )


def shifted(dx=0.0, dy=0.0, dz=0.0, quaternion=DOWN):
    x, y, z = START.position
    return Pose((x + dx, y + dy, z + dz), quaternion)


def test_a_trajectory_within_the_limits_passes_and_tells_the_joints_at_each_target():
    targets = [shifted(dx=0.005 * n) for n in range(1, 9)]
    joints = check(targets)
    for target, at_target in zip(targets, joints, strict=True):
        assert max(poses.distance(kinematics.forward(at_target), target)) < 1e-9


def test_a_long_step_is_refused_with_its_number_and_length():
    with pytest.raises(MotionRefusedError, match=r"step 2 of 2 .*25\.00 mm long, the limit is 20\.00 mm"):
        check([shifted(dx=0.01), shifted(dx=0.035)])


def test_a_large_turn_is_refused():
    turned = shifted(quaternion=poses.product(poses.about_z(math.radians(20)), DOWN))
    with pytest.raises(MotionRefusedError, match=r"turns by 20\.00°, the limit is 15\.00°"):
        check([turned])


def test_leaving_the_workspace_is_refused_with_the_axis():
    limits = MotionLimits(workspace=Box((0.4, -0.1, 0.3), (0.5, 0.01, 0.4)))
    with pytest.raises(
        MotionRefusedError, match=r"step 1 of 1 .*y = 0\.0\d+ m, the workspace is -0\.1000 \.\. 0\.01"
    ):
        check([shifted(dy=0.015)], limits)


def test_a_joint_at_its_end_is_refused_with_axis_and_range():
    limits = dataclasses.replace(WIDE, joint_limits=(*kinematics.JOINT_LIMITS[:4], (0.0, 0.9), (-7.0, 7.0)))
    with pytest.raises(MotionRefusedError, match=r"axis 5 would come to 5\d\.\d\d°, its range is 0 \.\. 52°"):
        check([shifted(dx=-0.15, dz=0.2)], limits)


def test_coming_close_to_the_wrist_singularity_is_refused():
    tilted = shifted(quaternion=poses.product(poses.about_y(math.radians(-42)), DOWN))
    with pytest.raises(
        MotionRefusedError, match=r"axis 5 would come within \d\.\d\d° of the wrist singularity"
    ):
        check([tilted], WIDE)


def test_crossing_the_singularity_between_two_good_ends_is_refused():
    beyond = shifted(quaternion=poses.product(poses.about_y(math.radians(-80)), DOWN))
    solutions = kinematics.inverse(beyond, near=START_JOINTS)
    assert kinematics.singularity_angle(solutions[0]) > WIDE.minimum_wrist_angle
    with pytest.raises(MotionRefusedError, match="wrist singularity"):
        check([beyond], WIDE)


def test_a_target_out_of_reach_is_refused():
    with pytest.raises(MotionRefusedError, match="out of reach"):
        check([shifted(dx=0.5)], WIDE)


def test_a_joint_that_would_have_to_turn_too_fast_is_refused():
    limits = dataclasses.replace(WIDE, linear_speed=100.0, angular_speed=100.0)
    with pytest.raises(MotionRefusedError, match=r"axis 1 would need \d+ °/s, its limit is 200 °/s"):
        check([shifted(dy=0.05)], limits, Speed(linear=50.0, angular=50.0))


@pytest.mark.parametrize(
    ("speed", "kind"),
    [
        (Speed(0.06, 0.1), "linear"),
        (Speed(0.01, 1.0), "angular"),
        (Speed(0.0, 0.1), "linear"),
        (Speed(0.01, math.nan), "angular"),
    ],
)
def test_a_speed_beyond_the_limit_or_none_is_refused(speed, kind):
    with pytest.raises(MotionRefusedError, match=f"{kind} speed"):
        check([shifted(dx=0.001)], speed=speed)


@pytest.mark.parametrize(
    "target",
    [
        Pose((math.nan, 0.0, 0.35), DOWN),
        Pose((0.45, 0.0, 0.35), (0.0, 0.0, 0.0, 0.0)),
        Pose((0.45, math.inf, 0.3)),
    ],
)
def test_a_target_that_is_no_pose_is_refused(target):
    with pytest.raises(MotionRefusedError, match="step 1 of 1"):
        check([target], WIDE)


def test_the_tool_frame_decides_where_the_wrist_is():
    """A tool of 0.3 m on the same pose puts the wrist 0.3 m higher, out of reach after a rise."""
    long_tool = Pose((0.0, 0.0, 0.45))
    near = (0.0, 0.0, 0.0, 0.0, 0.8, 0.0)
    joints = kinematics.inverse_continuous(poses.compose(START, poses.inverse(long_tool)), near)
    with pytest.raises(MotionRefusedError, match="step 1 of 1"):
        check_trajectory(WIDE, START, joints, [shifted(dz=0.3)], SLOW, long_tool)
    check([shifted(dz=0.3)], WIDE)


def test_an_empty_box_is_no_workspace():
    with pytest.raises(ConfigurationError, match="empty"):
        Box((0.0, 0.0, 0.5), (1.0, 1.0, 0.5))


def test_a_tool_under_way_must_be_on_its_line():
    target = shifted(dx=0.02)
    check_on_line(MotionLimits(), START, target, shifted(dx=0.013, dy=0.001))
    with pytest.raises(DeviceFaultError, match=r"3\.00 mm off its straight line"):
        check_on_line(MotionLimits(), START, target, shifted(dx=0.01, dz=0.003))
    with pytest.raises(DeviceFaultError, match=r"5\.00 mm off"):
        check_on_line(MotionLimits(), START, target, shifted(dx=0.025))


def test_staying_where_the_tool_is_is_no_motion_however_coarsely_the_joints_are_reported():
    coarse = tuple(round(angle, 3) for angle in START_JOINTS)
    check_trajectory(MotionLimits(), START, coarse, [START], SLOW)


def test_joints_that_do_not_belong_to_the_pose_are_refused():
    with pytest.raises(MotionRefusedError, match="do not belong"):
        check_trajectory(MotionLimits(), START, (1.0, *START_JOINTS[1:]), [START], SLOW)
