"""Weight, centre and bias from several poses; wrenches carried between frames."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot_drivers.ati.compensation.gravity import gravity_in_sensor, identify_tool, wrench_matrix
from robot_drivers.errors import ConfigurationError
from robot_drivers.protocols import Pose

MASS = 0.42
CENTRE = np.array([0.004, -0.011, 0.063])
BIAS = np.array([3.0, -1.5, 7.0, 0.12, -0.05, 0.02])
STD = np.array([0.01, 0.01, 0.02, 5e-4, 5e-4, 4e-4])
G = 9.80665
DOWN = {"+x": (1, 0, 0), "-y": (0, -1, 0), "+z": (0, 0, 1), "-z": (0, 0, -1)}


def readings(gravity, mass=MASS):
    """What a tool of that mass and a biased sensor read: force m g, torque c × m g."""
    force = mass * np.asarray(gravity)
    return np.hstack([force, np.cross(CENTRE, force)]) + BIAS


def test_gravity_is_turned_into_the_sensor_frame():
    # turned by +90° about the base's x axis, the sensor's y axis points up
    quarter = np.sqrt(0.5)
    found = gravity_in_sensor([[1, 0, 0, 0], [quarter, quarter, 0, 0]])
    np.testing.assert_allclose(found, [[0, 0, -G], [0, -G, 0]], atol=1e-12)


def test_three_poses_determine_weight_centre_and_bias():
    gravity = G * np.array([DOWN["+x"], DOWN["-y"], DOWN["-z"]])
    tool = identify_tool(gravity, readings(gravity), STD)
    assert tool.mass_kg == pytest.approx(MASS)
    np.testing.assert_allclose(tool.centre_m, CENTRE, atol=1e-12)
    np.testing.assert_allclose(tool.bias, BIAS, atol=1e-12)
    np.testing.assert_allclose(tool.residual_std, 0, atol=1e-12)
    elsewhere = G * np.array([0.6, 0.0, 0.8])
    np.testing.assert_allclose(tool.reading(elsewhere), readings(elsewhere), atol=1e-12)


def test_the_stated_covariances_are_those_that_occur():
    random = np.random.default_rng(4)
    gravity = G * np.array([*DOWN.values(), (0.6, 0.8, 0.0)])
    elsewhere = G * np.array([0.0, 0.6, -0.8])
    tools = [
        identify_tool(gravity, readings(gravity) + STD * random.standard_normal((5, 6)), STD)
        for _ in range(600)
    ]
    for value, stated in [
        ([tool.mass_kg for tool in tools], tools[0].mass_std_kg),
        ([tool.centre_m for tool in tools], np.sqrt(np.diag(tools[0].centre_covariance))),
        ([tool.bias for tool in tools], np.sqrt(np.diag(tools[0].covariance)[4:])),
        (
            [tool.reading(elsewhere) for tool in tools],
            np.sqrt(np.diag(tools[0].reading_covariance(elsewhere))),
        ),
    ]:
        np.testing.assert_allclose(np.std(value, axis=0), stated, rtol=0.12)


def test_a_noisy_reading_counts_less():
    gravity = G * np.array(list(DOWN.values()))
    measured = readings(gravity)
    measured[0] += 5.0
    std = np.tile(STD, (4, 1))
    std[0] = 1e3
    assert identify_tool(gravity, measured, std).mass_kg == pytest.approx(MASS, rel=1e-4)


@pytest.mark.parametrize(
    ("axes", "missing"),
    [
        (["-z"], "along [+-][xyz] and [+-][xy] of"),
        (["-z", "+z"], "along [+-][xy] of"),
        (["-z", "+x"], "along [+-]y of|along [-+][xz] of"),
        (["-z", "-z", "-z"], "along [+-][xyz] and [+-][xy] of"),
    ],
)
def test_poses_that_leave_something_open_name_the_ones_to_add(axes, missing):
    gravity = G * np.array([DOWN[axis] for axis in axes])
    with pytest.raises(ConfigurationError, match=missing):
        identify_tool(gravity, readings(gravity), STD)


def test_the_poses_named_as_missing_are_enough():
    vectors = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
    gravity = G * np.array([DOWN["-z"]])
    with pytest.raises(ConfigurationError) as refusal:
        identify_tool(gravity, readings(gravity), STD)
    named = str(refusal.value).split("along ")[1].removesuffix(" of the sensor").split(" and ")
    added = [(1 if axis[0] == "+" else -1) * np.array(vectors[axis[1]]) for axis in named]
    gravity = np.vstack([gravity, G * np.array(added)])
    assert identify_tool(gravity, readings(gravity), STD).mass_kg == pytest.approx(MASS)


def test_small_tilts_are_not_enough():
    tilts = Rotation.from_euler("xy", [[0, 0], [3, 0], [0, 3]], degrees=True)
    gravity = tilts.apply([0, 0, -G])
    with pytest.raises(ConfigurationError, match="add poses"):
        identify_tool(gravity, readings(gravity), STD)


def test_a_sensor_without_a_tool_is_told_from_one_with():
    gravity = G * np.array(list(DOWN.values()))
    with pytest.raises(ConfigurationError, match="cannot be told from none"):
        identify_tool(gravity, readings(gravity, mass=0.0), STD)
    with pytest.raises(ConfigurationError, match="sign of gravity"):
        identify_tool(-gravity, readings(gravity), STD)


@pytest.mark.parametrize(
    ("gravity", "measured", "std", "what"),
    [
        (np.ones((3, 2)), np.ones((3, 6)), STD, r"must be \(n, 3\) and \(n, 6\)"),
        (np.ones((3, 3)), np.ones((2, 6)), STD, r"must be \(n, 3\) and \(n, 6\)"),
        (np.full((3, 3), np.nan), np.ones((3, 6)), STD, "finite"),
        (np.zeros((3, 3)), np.ones((3, 6)), STD, "gravity not zero"),
        (np.eye(3), np.ones((3, 6)), 0 * STD, "deviations positive"),
    ],
)
def test_input_that_cannot_be_is_refused(gravity, measured, std, what):
    with pytest.raises(ConfigurationError, match=what):
        identify_tool(gravity, measured, std)


def test_a_wrench_is_carried_to_another_frame():
    # b lies 0.1 m along x of a and is turned by 90° about z: its x axis is a's y axis
    T_a_b = Pose((0.1, 0.0, 0.0), (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
    carried = wrench_matrix(T_a_b) @ [1.0, 0.0, 0.0, 0.0, 0.0, 0.5]
    np.testing.assert_allclose(carried, [0, 1, 0, 0, 0, 0.5 + 0.1], atol=1e-12)


@given(
    st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    st.lists(st.floats(-1, 1), min_size=12, max_size=12),
)
def test_the_power_of_a_wrench_is_the_same_in_every_frame(position, rotation_vector, numbers):
    rotation = Rotation.from_rotvec(rotation_vector)
    T_a_b = Pose(tuple(position), tuple(np.roll(rotation.as_quat(), 1)))
    wrench_b, velocity_a, spin_a = np.array(numbers[:6]), np.array(numbers[6:9]), np.array(numbers[9:])
    wrench_a = wrench_matrix(T_a_b) @ wrench_b
    velocity_b = rotation.inv().apply(velocity_a + np.cross(spin_a, position))
    spin_b = rotation.inv().apply(spin_a)
    power_b = wrench_b[:3] @ velocity_b + wrench_b[3:] @ spin_b
    assert wrench_a[:3] @ velocity_a + wrench_a[3:] @ spin_a == pytest.approx(power_b, abs=1e-9)
