"""The closed-form kinematics of the IRB 140, against a published table and an independent library."""

import math
import random

import numpy as np
import pytest
from py_opw_kinematics import KinematicModel, Robot
from scipy.spatial.transform import Rotation

from robot_drivers.abb.motion import kinematics
from robot_drivers.errors import MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose

# joint angles (°), tool0 position (mm), quaternion (scalar first): three independent models agree on these
TABLE = [
    ((0, 0, 0, 0, 0, 0), (515, 0, 712), (0.707107, 0, 0.707107, 0)),
    ((0, 0, 0, 0, 30, 0), (506.2917, 0, 679.5), (0.5, 0, 0.866025, 0)),
    ((0, 0, 0, 0, 90, 0), (450, 0, 647), (0, 0, 1, 0)),
    ((0, -90, 0, 0, 0, 0), (-290, 0, 797), (1, 0, 0, 0)),
    (
        (30, 20, -10, 15, 45, -60),
        (517.9183, 312.7564, 572.6005),
        (0.31794, -0.625993, 0.711228, 0.034671),
    ),
    (
        (-45, 40, -60, 90, -30, 120),
        (480.0432, -526.0051, 776.9965),
        (0.25046, 0.310479, -0.505474, 0.765094),
    ),
]


def radians(joints_deg):
    return tuple(math.radians(angle) for angle in joints_deg)


def random_joints(count, seed=0):
    generator = random.Random(seed)
    return [tuple(generator.uniform(*limits) for limits in kinematics.JOINT_LIMITS) for _ in range(count)]


@pytest.mark.parametrize(("joints_deg", "position_mm", "quaternion"), TABLE)
def test_forward_kinematics_reproduce_the_table(joints_deg, position_mm, quaternion):
    flange = kinematics.forward(radians(joints_deg))
    assert np.multiply(flange.position, 1e3) == pytest.approx(position_mm, abs=1e-4)
    assert poses.distance(flange, Pose(flange.position, quaternion))[1] < 2e-6


def test_forward_kinematics_agree_with_opw():
    opw = Robot(
        KinematicModel(
            a1=0.070, c1=0.352, c2=0.360, c3=0.380, c4=0.065, offsets=(0, 0, -math.pi / 2, 0, 0, 0)
        ),
        degrees=False,
    )
    for joints in random_joints(50):
        expected = opw.forward(joints)
        flange = kinematics.forward(joints)
        assert flange.position == pytest.approx(expected.translation, abs=1e-12)
        rotation = Rotation.from_quat(flange.quaternion_wxyz, scalar_first=True)
        assert (rotation.inv() * expected.rotation).magnitude() < 1e-12


def test_every_solution_of_opw_is_among_ours():
    opw = Robot(
        KinematicModel(
            a1=0.070, c1=0.352, c2=0.360, c3=0.380, c4=0.065, offsets=(0, 0, -math.pi / 2, 0, 0, 0)
        ),
        degrees=False,
    )
    for joints in random_joints(50, seed=1):
        ours = kinematics.inverse(kinematics.forward(joints), near=joints)
        for theirs in opw.inverse(opw.forward(joints)):
            apart = [
                max(abs(math.remainder(a - b, 2 * math.pi)) for a, b in zip(solution, theirs, strict=True))
                for solution in ours
            ]
            assert min(apart) < 1e-6


def test_every_solution_reaches_the_pose_and_the_first_is_where_we_came_from():
    for joints in random_joints(300, seed=2):
        pose = kinematics.forward(joints)
        solutions = kinematics.inverse(pose, near=joints)
        assert solutions[0] == pytest.approx(joints, abs=1e-6)
        for solution in solutions:
            assert max(poses.distance(kinematics.forward(solution), pose)) < 1e-10


def test_angles_continue_beyond_half_a_turn():
    joints = radians((0, 20, 10, 190, 50, -350))
    assert kinematics.inverse(kinematics.forward(joints), near=joints)[0] == pytest.approx(joints, abs=1e-9)


@pytest.mark.parametrize("q5_deg", [0.0, 180.0])
def test_an_aligned_wrist_keeps_axis_4_where_it_is(q5_deg):
    joints = radians((10, 20, -30, 40, q5_deg, 60))
    pose = kinematics.forward(joints)
    solution = kinematics.inverse(pose, near=joints)[0]
    assert solution[3] == pytest.approx(joints[3], abs=1e-9)
    assert max(poses.distance(kinematics.forward(solution), pose)) < 1e-9


def test_a_pose_out_of_reach_has_no_solution_and_is_refused_with_its_position():
    far = Pose((1.2, 0.0, 0.4))
    assert kinematics.inverse(far, near=(0.0,) * 6) == []
    with pytest.raises(MotionRefusedError, match=r"1\.2000.*out of reach"):
        kinematics.inverse_continuous(far, near=(0.0,) * 6)


def test_reach_is_that_of_the_data_sheet():
    """810 mm from axis 1 to axis 5 with the arm stretched, 1092 mm above the floor standing up."""
    stretched = kinematics.forward(radians((0, 90, -90, 0, 0, 0)))
    assert stretched.position[0] - kinematics.WRIST_TO_FLANGE == pytest.approx(0.810)
    upright = kinematics.forward(radians((0, 0, -90, 0, 0, 0)))
    assert upright.position[2] - kinematics.WRIST_TO_FLANGE == pytest.approx(1.092)


def test_the_distance_from_the_wrist_singularity_is_the_bend_of_axis_5():
    assert kinematics.singularity_angle(radians((0, 0, 0, 0, -30, 0))) == pytest.approx(math.radians(30))
    assert kinematics.singularity_angle((0.0,) * 6) == 0.0


def test_interpolation_is_straight_and_turns_the_short_way_at_constant_rate():
    start = Pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    end = Pose((0.01, -0.02, 0.03), tuple(-q for q in poses.about_z(math.radians(40))))
    quarter = poses.interpolate(start, end, 0.25)
    assert quarter.position == pytest.approx((0.0025, -0.005, 0.0075))
    assert poses.distance(start, quarter)[1] == pytest.approx(math.radians(10))


def test_composing_with_the_inverse_gives_the_identity():
    T_a_b = Pose((0.1, -0.2, 0.3), poses.product(poses.about_x(0.4), poses.about_y(-1.1)))
    for identity in (poses.compose(T_a_b, poses.inverse(T_a_b)), poses.compose(poses.inverse(T_a_b), T_a_b)):
        assert max(poses.distance(identity, poses.IDENTITY)) < 1e-15


@pytest.mark.parametrize(
    "vector", [(0.0, 0.0, 0.0), (1e-12, 0.0, 0.0), (0.3, -0.2, 0.1), (0.0, 3.1, 0.0), (0.0, 0.0, -2.0)]
)
def test_the_rotation_vector_of_a_quaternion_and_of_its_negative_is_that_of_the_rotation(
    vector: tuple[float, float, float],
) -> None:
    w, x, y, z = Rotation.from_rotvec(vector).as_quat(scalar_first=True).tolist()
    assert poses.rotation_vector((w, x, y, z)) == pytest.approx(vector, rel=1e-12)
    assert poses.rotation_vector((-w, -x, -y, -z)) == pytest.approx(vector, rel=1e-12)
