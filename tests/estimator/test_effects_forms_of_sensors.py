"""Forms of a sensor's error and of the robot's way that differ in the frame, the experiment or the course."""

import numpy as np
import pytest
from effect_cases import felt, position_change, there_and_back, wrench_change
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Effect
from estimator.effects.force.force_axis_gain import ForceAxisGain, ForceGains
from estimator.effects.force.force_bias import ForceBias, ForceBiasInOne
from estimator.effects.force.force_crosstalk import ForceCrosstalk, ForceCrosstalkInTissue
from estimator.effects.force.force_drift import ForceDrift
from estimator.effects.force.force_frame_rotation import ForceFrameRotation
from estimator.effects.force.time_offset import Filtered, TimeOffset
from estimator.effects.motion.motion_scale import AxisScale, MotionScale
from estimator.effects.motion.robot_backlash import AxisBacklash, RobotBacklash

WRENCH = np.array([-2.0, 0.3, 0.1, 0.004, -0.002, 0.03])
YAW = (0.0, 0.0, np.pi / 2)


@pytest.mark.parametrize(
    ("in_tissue", "in_sensor", "given"),
    [
        (ForceGains("tissue"), ForceGains("sensor"), {"gain_fx": 0.1, "gain_tz": -0.05}),
        (ForceCrosstalkInTissue(), ForceCrosstalk(), {"fx_into_fz": 0.02, "tz_into_fy": 0.01}),
        (ForceFrameRotation("tissue"), ForceFrameRotation(), {"rotation_z": 0.1, "rotation_x": 0.05}),
    ],
    ids=["gain", "leak", "turn"],
)
def test_an_error_in_the_tissue_s_axes_is_the_sensor_s_until_the_gripper_turns(
    in_tissue: Effect, in_sensor: Effect, given: dict[str, float]
) -> None:
    readings = felt(there_and_back(turn_rad=YAW), WRENCH)
    tissue, sensor = (wrench_change(one, readings, **given) for one in (in_tissue, in_sensor))
    assert_allclose(tissue[0], sensor[0], atol=1e-15)
    assert_allclose(tissue, np.tile(tissue[0], (len(tissue), 1)), atol=1e-15)
    assert np.abs(tissue[22] - sensor[22]).max() > 0.01


def test_gains_of_all_axes_are_those_of_each() -> None:
    readings = felt(there_and_back(turn_rad=YAW), WRENCH)
    together = wrench_change(ForceGains("sensor"), readings, gain_fx=0.1, gain_ty=-0.2)
    apart = [
        wrench_change(ForceAxisGain(name), readings, gain=gain) for name, gain in (("fx", 0.1), ("ty", -0.2))
    ]
    assert_allclose(together, sum(apart), atol=1e-15)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_zero_that_was_off_once_shows_in_that_experiment_alone(order: int) -> None:
    readings = felt(there_and_back(order), WRENCH)
    found = wrench_change(ForceBiasInOne(), readings, order=2.0, bias_fy=0.1)
    everywhere = wrench_change(ForceBias("sensor"), readings, bias_fy=0.1)
    assert_allclose(found, everywhere if order == 2 else 0.0 * everywhere)


def test_drift_by_a_power_of_time_has_its_mean_rate_over_a_minute_whatever_the_power() -> None:
    readings = felt(there_and_back())
    given = {"drift_fx": -0.2 / 60}
    straight = wrench_change(ForceDrift("linear", "sensor"), readings, **given)
    root, first = (
        wrench_change(ForceDrift("power", "sensor"), readings, **given, power=power) for power in (0.5, 1.0)
    )
    assert_allclose(first, straight, atol=1e-15)
    assert_allclose(root[15, 0], -0.2)  # the row of 60 s
    assert_allclose(root[60 // 16, 0], -0.2 * np.sqrt(12.0 / 60.0))


@pytest.mark.parametrize("filter_time", [1.0, 6.0, 40.0])
def test_a_filter_is_the_differential_equation_that_it_is_said_to_be(filter_time: float) -> None:
    readings = felt(there_and_back())
    time, load = readings.experiment.time, readings.wrench[:, 0]

    def slope(at: float, y: np.ndarray) -> np.ndarray:
        return (np.interp(at, time, load) - y) / filter_time

    solved = solve_ivp(slope, time[[0, -1]], load[:1], t_eval=time, max_step=0.2, rtol=1e-8, atol=1e-10)
    found = load + wrench_change(Filtered(), readings, filter_time=filter_time)[:, 0]
    assert_allclose(found, solved.y[0], atol=2e-4 * np.abs(load).max())


def test_a_quick_filter_is_a_lag_where_the_load_is_steady() -> None:
    readings = felt(there_and_back())
    filtered = wrench_change(Filtered(), readings, filter_time=0.5)
    late = wrench_change(TimeOffset("lag"), readings, lag=0.5)
    assert_allclose(filtered[5:20], late[5:20], atol=1e-3 * np.abs(late).max())


def test_axes_of_one_scale_are_a_scale_and_one_axis_scales_its_own_way_alone() -> None:
    motion = there_and_back()
    oblique = motion.moved(motion.position + 0.5 * (motion.position - motion.position[0])[:, [1, 0, 2]])
    alike = position_change(AxisScale(), oblique, **{f"scale_error_{axis}": 0.02 for axis in "xyz"})
    assert_allclose(alike, position_change(MotionScale(), oblique, scale_error=0.02), atol=1e-15)
    assert_allclose(position_change(AxisScale(), oblique, scale_error_y=0.02)[:, [0, 2]], 0.0, atol=1e-15)


def test_play_of_each_axis_is_that_of_the_way_along_one_and_as_wide_across_it() -> None:
    motion = there_and_back()
    given = {"width": 4e-4, "start": 1.0}
    along = position_change(AxisBacklash(), motion, **given)
    assert_allclose(
        along, position_change(RobotBacklash("translation", "anywhere"), motion, **given), atol=1e-15
    )
    turned = motion.moved(
        motion.position[0] + Rotation.from_rotvec([0, 0, 0.2]).apply(motion.position - motion.position[0])
    )
    lost = position_change(AxisBacklash(), turned, **given)
    assert_allclose(np.abs(lost[-1, :2]), 4e-4, atol=1e-9)
