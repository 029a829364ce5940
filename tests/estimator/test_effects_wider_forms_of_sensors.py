"""Forms in which a sensor, a clock or the robot errs that are no line of the load or of time, or of one part alone."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from effect_cases import (
    ROLL,
    STIFFNESS,
    YAW,
    felt,
    position_change,
    there_and_back,
    with_values,
    wrench_change,
)
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Effect, Motion, Readings
from estimator.effects.force.force_axis_gain import ForceAxisGain, ForceBentGain
from estimator.effects.force.force_crosstalk import ForcePairCrosstalk, ForcePairCrosstalkThatBends
from estimator.effects.force.force_drift import PeriodicDrift
from estimator.effects.force.force_frame_rotation import ForceFrameRotation, ForceFrameThatGives
from estimator.effects.force.time_offset import GrowingOffset, TimeOffset
from estimator.effects.force.tool_weight import TiltedGravity
from estimator.effects.force.torque_centre import TorqueCentre, TorqueCentreThatGives
from estimator.effects.motion.motion_direction import PoseDirection, TurnDirection
from estimator.effects.motion.motion_scale import PoseScale, TurnScale

FloatArray = NDArray[np.float64]

WRENCH = np.array([-2.0, 0.3, 0.1, 0.004, -0.002, 0.03])
PULL = np.array([-2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
END = 22  # a row in which the gripper stands at the end of its way
WEIGHT_N, HEIGHT_M = 0.35 * 9.81, 0.06  # of the tool, and its centre above the sensor


def turn_of(effect: Effect, motion: Motion, **given: float) -> FloatArray:
    """The gripper's rotation vectors (n, 3) under an effect, rad."""
    return effect.motion(motion, with_values(effect, given)).rotation.as_rotvec()


def at_load(times: float) -> Readings:
    return felt(there_and_back(), times * WRENCH)


@pytest.mark.parametrize(
    ("alone", "with_the_way", "given"),
    [
        (TurnScale(), PoseScale(), {"scale_error": 0.05}),
        (TurnDirection(), PoseDirection(), {"rotation_x": 0.1, "rotation_y": -0.05}),
    ],
    ids=["scale", "direction"],
)
def test_a_turn_that_is_off_alone_turns_as_with_the_way_and_leaves_the_way(
    alone: Effect, with_the_way: Effect, given: dict[str, float]
) -> None:
    motion = there_and_back(turn_rad=YAW)
    assert not position_change(alone, motion, **given).any()
    assert_allclose(turn_of(alone, motion, **given), turn_of(with_the_way, motion, **given), atol=1e-15)


def test_a_scaled_turn_keeps_its_axis_and_an_axis_that_is_askew_keeps_the_angle() -> None:
    motion = there_and_back(turn_rad=YAW)
    plain = motion.rotation.as_rotvec()
    assert_allclose(turn_of(TurnScale(), motion, scale_error=0.05), 1.05 * plain, atol=1e-15)
    askew = turn_of(TurnDirection(), motion, rotation_x=0.1)
    assert_allclose(askew, plain @ Rotation.from_rotvec([0.1, 0, 0]).as_matrix().T, atol=1e-15)


def test_neither_is_seen_where_the_gripper_does_not_turn() -> None:
    motion = there_and_back()
    for effect, given in ((TurnScale(), {"scale_error": 0.1}), (TurnDirection(), {"rotation_z": 0.2})):
        assert_allclose(turn_of(effect, motion, **given), 0.0, atol=1e-15)


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), YAW, ROLL])
def test_a_leaning_base_shows_as_far_as_the_gripper_turns(turn: tuple[float, float, float]) -> None:
    readings = felt(there_and_back(turn_rad=turn), np.zeros(6))
    change = wrench_change(TiltedGravity(), readings, tilt_x=0.1, tilt_y=-0.05)
    astray = WEIGHT_N * (Rotation.from_rotvec([0.1, -0.05, 0.0]).apply([0, 0, -1.0]) - [0, 0, -1.0])
    # What is wrong with the weight stays where it is, and what was zeroed at first turns with the gripper.
    expected = astray - readings.rotation.apply(astray)
    assert_allclose(change[:, :3], expected, atol=1e-12)
    lever = HEIGHT_M * readings.rotation.apply([0.0, 0.0, 1.0])
    zeroed = readings.rotation.apply(np.cross([0.0, 0.0, HEIGHT_M], astray))
    assert_allclose(change[:, 3:], np.cross(lever, astray) - zeroed, atol=1e-12)


@pytest.mark.parametrize("down", [(0.0, 0.0, 9.81), (9.81, 0.0, 0.0), (0.0, -6.0, -7.0)])
def test_gravity_is_turned_by_the_tilt_wherever_it_points(down: tuple[float, float, float]) -> None:
    motion = there_and_back(turn_rad=(0.4, -0.3, np.pi / 3))
    environment = replace(motion.experiment.environment, gravity=down)
    other = replace(motion, experiment=replace(motion.experiment, environment=environment))
    (told,) = TiltedGravity().sensor_steps(other.experiment, {"tilt_x": 0.08, "tilt_y": 0.06})
    stated = np.array(down)
    leaning, size = stated + np.array(told["gravity"]), float(np.linalg.norm(stated))
    assert np.linalg.norm(leaning) == pytest.approx(size)
    assert np.arccos(leaning @ stated / size**2) == pytest.approx(0.1, rel=1e-9)


def test_nothing_leans_without_gravity_or_without_a_tool() -> None:
    motion = there_and_back(turn_rad=ROLL)
    floating = replace(motion.experiment.environment, gravity=(0.0, 0.0, 0.0))
    without = replace(motion.experiment.sensor, tool_mass=0.0)
    for changed in ({"environment": floating}, {"sensor": without}):
        other = felt(replace(motion, experiment=replace(motion.experiment, **changed)))
        assert not wrench_change(TiltedGravity(), other, tilt_x=0.1, tilt_y=0.2).any()


@pytest.mark.parametrize("times", [0.5, 1.0, 3.0])
@pytest.mark.parametrize(
    ("giving", "fixed", "names"),
    [
        (ForceFrameThatGives(), ForceFrameRotation(), ("rotation_per_force_z", "rotation_z")),
        (TorqueCentreThatGives(), TorqueCentre("gripper"), ("centre_per_force_y", "centre_y")),
    ],
    ids=["frame", "centre"],
)
def test_a_mount_that_gives_is_off_as_a_fixed_one_by_the_load_s_size(
    giving: Effect, fixed: Effect, names: tuple[str, str], times: float
) -> None:
    readings = felt(there_and_back(turn_rad=YAW), times * WRENCH)
    force = times * float(np.linalg.norm(WRENCH[:3]))
    found = wrench_change(giving, readings, **{names[0]: 0.01})
    assert_allclose(found, wrench_change(fixed, readings, **{names[1]: 0.01 * force}), atol=1e-14)


@pytest.mark.parametrize(("way", "sign"), [("lag", 1.0), ("lead", -1.0)])
def test_a_clock_that_runs_slow_or_fast_is_off_by_more_the_longer_it_runs(
    way: Literal["lag", "lead"], sign: float
) -> None:
    readings = felt(there_and_back())
    time, per_second = readings.experiment.time, STIFFNESS * 0.02 / 80.0
    change = wrench_change(GrowingOffset(way), readings, rate=0.01)[:, 0]
    assert_allclose(change[:20], sign * 0.01 * time[:20] * per_second, atol=1e-12)
    assert_allclose(change[22:25], 0.0, atol=1e-12)
    assert_allclose(change[26:45], -sign * 0.01 * time[26:45] * per_second, atol=1e-12)


def test_each_experiment_begins_with_clocks_that_agree() -> None:
    motion = there_and_back(order=3)
    later = replace(motion, experiment=replace(motion.experiment, time=1e3 + motion.experiment.time))
    first, second = (wrench_change(GrowingOffset("lag"), felt(one), rate=0.01) for one in (motion, later))
    assert_allclose(second, first, atol=1e-12)


def test_at_any_row_a_slow_clock_is_late_by_what_it_has_lost() -> None:
    readings = felt(there_and_back(turn_rad=YAW))
    slow = wrench_change(GrowingOffset("lag"), readings, rate=0.03)
    lost = 0.03 * readings.experiment.time[30]
    assert_allclose(slow[30], wrench_change(TimeOffset("lag"), readings, lag=lost)[30], atol=1e-12)


@pytest.mark.parametrize(("times", "share"), [(1.0, 1.0), (0.5, 0.25), (-1.0, 1.0)])
def test_a_gain_that_bends_is_off_by_the_square_of_the_load_s_share(times: float, share: float) -> None:
    readings = at_load(times)
    bent = wrench_change(ForceBentGain(), readings, bend=0.1, channel=0.0, largest_load=2.0)
    assert_allclose(bent, wrench_change(ForceAxisGain("fx"), readings, gain=0.1 * share), atol=1e-15)


def test_a_leak_that_bends_has_one_sign_whichever_way_the_load_goes() -> None:
    pair = {"source": 0.0, "target": 4.0, "leak": 0.03}
    for times, share in ((1.0, 1.0), (0.5, 0.5), (-1.0, -1.0), (-0.5, -0.5)):
        bent = wrench_change(ForcePairCrosstalkThatBends(), at_load(times), **pair, largest_load=2.0)
        plain = wrench_change(ForcePairCrosstalk(), at_load(times), **pair)
        # The load along x is -2 N, so that a share of its square over 2 N is minus that of a line.
        assert_allclose(bent, -share * plain, atol=1e-15)


def test_what_bends_is_looked_for_at_the_largest_load_of_all_experiments() -> None:
    loads = [at_load(0.5), at_load(-1.5)]
    begun = {one["channel"]: one["largest_load"] for one in ForceBentGain().starts(loads)}
    assert begun == pytest.approx(dict(enumerate(1.5 * np.abs(WRENCH))))
    idle = felt(there_and_back(), PULL)
    assert ForceBentGain().starts([idle]) == [{"channel": 0.0, "largest_load": 2.0}]


def test_the_pair_that_leaks_by_the_square_is_found_in_the_misfit() -> None:
    effect, baseline = ForcePairCrosstalkThatBends(), []
    true = {"source": 0.0, "target": 4.0, "largest_load": 2.0}
    for motion in (there_and_back(1), there_and_back(2, YAW)):
        readings = felt(motion)
        leaking = effect.readings(readings, {**true, "leak": 0.05}).wrench
        baseline.append(replace(readings, experiment=replace(readings.experiment, wrench=leaking)))
    assert effect.starts(baseline)[0] == pytest.approx(true)


def test_a_zero_that_comes_back_is_off_by_nothing_after_each_period_and_most_after_half_of_it() -> None:
    readings = felt(there_and_back(), PULL)
    change = wrench_change(PeriodicDrift(), readings, cosine_fy=0.1, period=80.0, turns_between=0.3)
    assert_allclose(change[[0, 20, 40], 1], 0.0, atol=1e-15)
    assert_allclose(change[[10, 30], 1], -0.2)
    assert_allclose(np.delete(change, 1, axis=1), 0.0, atol=1e-15)


def test_the_next_experiment_begins_further_in_the_room_s_course() -> None:
    given = {"sine_tz": 2e-3, "period": 80.0, "turns_between": 0.25}
    first, second = (wrench_change(PeriodicDrift(), felt(there_and_back(order)), **given) for order in (1, 2))
    # A quarter of 80 s later the first experiment is where the second begins.
    assert_allclose(second[:40, 5], first[5:45, 5] - first[5, 5], atol=1e-15)
    whole = wrench_change(PeriodicDrift(), felt(there_and_back(2)), **{**given, "turns_between": 1.0})
    assert_allclose(whole, first, atol=1e-15)


def test_such_a_zero_turns_with_the_sensor() -> None:
    readings = felt(there_and_back(turn_rad=(0.0, 0.0, np.pi / 2)), PULL)
    change = wrench_change(PeriodicDrift(), readings, sine_fx=0.1, period=320.0, turns_between=0.0)
    expected = 0.1 * np.sin(2 * np.pi * readings.experiment.time[END] / 320.0)
    assert_allclose(change[END], [0.0, expected, 0.0, 0.0, 0.0, 0.0], atol=1e-15)
