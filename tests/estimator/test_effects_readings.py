from dataclasses import replace

import numpy as np
import pytest
from effect_cases import (
    ROLL,
    STIFFNESS,
    YAW,
    at_null,
    felt,
    there_and_back,
    three_experiments,
    with_values,
    wrench_change,
)
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from estimator.effects.catalogue import CATALOGUE, LABELS, OUTSIDERS
from estimator.effects.effect import Effect
from estimator.effects.force.force_axis_gain import ForceAxisGain
from estimator.effects.force.force_bias import ForceBias
from estimator.effects.force.force_crosstalk import ForceCrosstalk, ForcePairCrosstalk
from estimator.effects.force.force_drift import ForceDrift
from estimator.effects.force.force_frame_rotation import ForceFrameRotation
from estimator.effects.force.time_offset import TimeOffset
from estimator.effects.force.tool_weight import ToolWeight, ToolWeightAndCentre
from estimator.effects.force.torque_centre import TorqueCentre
from estimator.effects.vision.camera_scale import CameraScale, CameraScaleInPlane

SENSOR_LABELS = {label for label, group in LABELS.items() if group in ("force", "timing", "vision")}
OF_SENSORS = [*(effect for effect in CATALOGUE if effect.label in SENSOR_LABELS), *OUTSIDERS]
WRENCH = np.array([-2.0, 0.3, 0.1, 0.004, -0.002, 0.03])


def of_name(effect: Effect) -> str:
    return effect.name


@pytest.mark.parametrize("effect", OF_SENSORS, ids=of_name)
def test_at_its_null_a_sensor_effect_changes_no_reading(effect):
    experiments = three_experiments()
    values = {**effect.starts(experiments)[0], **at_null(effect)}
    for readings in experiments:
        result = effect.readings(readings, values)
        assert_allclose(result.wrench, readings.wrench, rtol=0, atol=1e-15)
        assert_array_equal(result.fiducials, readings.fiducials)


@pytest.mark.parametrize("effect", OF_SENSORS, ids=of_name)
def test_a_sensor_effect_leaves_its_null_without_a_kink(effect):
    experiments = three_experiments()
    constants = effect.starts(experiments)[0]
    wholly = {
        **constants,
        **at_null(effect),
        **({"exchanged": 1.0} if "exchanged" in at_null(effect) else {}),
    }

    def read(name, size):
        parts = [effect.readings(each, {**wholly, name: size}) for each in experiments]
        return np.concatenate([np.concatenate([p.wrench.ravel(), p.fiducials.ravel()]) for p in parts])

    for amplitude in effect.amplitudes:
        step = 1e-3 * amplitude.scale
        once = read(amplitude.name, step) - read(amplitude.name, 0.0)
        twice = read(amplitude.name, 2 * step) - read(amplitude.name, 0.0)
        assert np.linalg.norm(twice - 2 * once) <= 1e-3 * np.linalg.norm(once) + 1e-14
        if amplitude.lower < 0:
            back = read(amplitude.name, -step) - read(amplitude.name, 0.0)
            assert np.linalg.norm(once + back) <= 1e-3 * np.linalg.norm(once) + 1e-14


def test_a_bias_of_the_sensor_turns_with_the_gripper_and_one_of_the_software_does_not():
    readings = felt(there_and_back(turn_rad=(0.0, 0.0, np.pi / 2)), WRENCH)
    of_sensor = wrench_change(ForceBias("sensor"), readings, bias_fx=0.1)
    of_software = wrench_change(ForceBias("tissue"), readings, bias_fx=0.1)
    assert_allclose(of_sensor[22], [0.0, 0.1, 0.0, 0.0, 0.0, 0.0], atol=1e-12)
    assert_allclose(of_software, np.tile([0.1, 0, 0, 0, 0, 0], (46, 1)), atol=1e-12)


def test_the_bias_of_one_axis_is_that_of_all_with_the_others_at_zero():
    readings = felt(there_and_back(turn_rad=(0.0, 0.0, np.pi / 2)), WRENCH)
    alone = ForceBias("sensor", "ty")
    assert [amplitude.name for amplitude in alone.amplitudes] == ["bias_ty"]
    of_one = wrench_change(alone, readings, bias_ty=0.002)
    assert_allclose(of_one, wrench_change(ForceBias("sensor"), readings, bias_ty=0.002))
    assert np.abs(of_one).max() == pytest.approx(0.002)


def test_steady_drift_has_grown_by_its_rate_times_a_minute_after_a_minute():
    drift = wrench_change(
        ForceDrift("linear", "tissue"), felt(there_and_back()), drift_fx=-0.2 / 60, drift_tz=1e-4
    )
    assert_allclose(drift[0], 0.0)
    assert_allclose(drift[15], [-0.2, 0, 0, 0, 0, 6e-3])  # the row of 60 s


def test_a_sensor_that_was_zeroed_once_has_drifted_between_the_experiments_too():
    given = {"drift_fx": 1e-3, "interval": 200.0}
    first, second = (
        wrench_change(ForceDrift("zeroed_once", "sensor"), felt(there_and_back(order)), **given)
        for order in (1, 2)
    )
    assert_allclose(first[0], 0.0)
    assert_allclose(second - first, np.tile([0.2, 0, 0, 0, 0, 0], (len(first), 1)), atol=1e-12)


def test_saturating_drift_reaches_a_share_of_its_end_after_one_time_constant():
    effect = ForceDrift("saturating", "tissue")
    drift = wrench_change(effect, felt(there_and_back()), drift_fy=0.01, time_constant=60.0)
    assert_allclose(drift[15, 1], 0.01 * 60.0 * (1 - np.exp(-1)))
    slow = wrench_change(effect, felt(there_and_back()), drift_fy=0.01, time_constant=1e7)
    assert_allclose(slow[:, 1], 0.01 * there_and_back().experiment.time, rtol=1e-4)


def test_warming_that_runs_on_continues_in_the_next_experiment_where_it_stood():
    effect = ForceDrift("running_on", "tissue")
    given = {"drift_fz": 0.01, "time_constant": 60.0, "interval": 180.0}
    first, second = (wrench_change(effect, felt(there_and_back(order)), **given) for order in (1, 2))
    assert_allclose(first[45, 2] + second[20, 2], 0.6 * (1 - np.exp(-(180.0 + 80.0) / 60.0)))


def test_a_gain_scales_one_axis_of_the_gripper_and_no_other():
    readings = felt(there_and_back(turn_rad=(0.0, 0.0, np.pi / 2)), WRENCH)
    change = wrench_change(ForceAxisGain("fy"), readings, gain=0.1)
    assert_allclose(change[0], [0, 0.03, 0, 0, 0, 0], atol=1e-12)
    # Turned by a right angle, the sensor's y axis points along the tissue's -x.
    assert_allclose(change[22], [-0.2, 0, 0, 0, 0, 0], atol=1e-12)


def test_crosstalk_of_a_pair_is_that_entry_of_the_whole_matrix():
    readings = felt(there_and_back(turn_rad=ROLL), WRENCH)
    pair = wrench_change(ForcePairCrosstalk(), readings, source=0.0, target=2.0, leak=0.03)
    assert_allclose(pair, wrench_change(ForceCrosstalk(), readings, fx_into_fz=0.03), atol=1e-15)
    assert_allclose(pair[0], [0, 0, -0.06, 0, 0, 0], atol=1e-15)


def test_the_pair_that_leaks_is_found_in_the_misfit():
    effect, constants, baseline = ForcePairCrosstalk(), {"source": 0.0, "target": 4.0}, []
    for readings in three_experiments():
        leaking = effect.readings(readings, {**constants, "leak": 0.05}).wrench
        baseline.append(replace(readings, experiment=replace(readings.experiment, wrench=leaking)))
    assert effect.starts(baseline)[0] == constants


def test_a_sensor_turned_by_a_right_angle_takes_the_force_along_y_for_one_along_x():
    readings = felt(there_and_back(), WRENCH)
    change = wrench_change(ForceFrameRotation(), readings, rotation_z=np.pi / 2)
    assert_allclose((WRENCH + change)[0], [0.3, 2.0, 0.1, -0.002, -0.004, 0.03], atol=1e-12)


def test_a_turned_sensor_keeps_the_lengths_of_force_and_torque():
    readings = felt(there_and_back(turn_rad=YAW), WRENCH)
    turned = WRENCH + wrench_change(ForceFrameRotation(), readings, rotation_x=0.05, rotation_y=-0.08)
    for part in (slice(0, 3), slice(3, 6)):
        assert_allclose(np.linalg.norm(turned[:, part], axis=1), np.linalg.norm(WRENCH[part]))


def test_about_a_point_to_the_side_of_the_pull_the_torque_gains_the_pull_times_its_arm():
    readings = felt(there_and_back(turn_rad=(0.0, 0.0, np.pi)), np.array([-2.0, 0, 0, 0, 0, 0]))
    change = wrench_change(TorqueCentre("gripper"), readings, centre_y=3e-3)
    assert_allclose(change[0], [0, 0, 0, 0, 0, -6e-3], atol=1e-15)
    # The point turns with the gripper and lies on the other side after half a turn.
    assert_allclose(change[22], [0, 0, 0, 0, 0, 6e-3], atol=1e-15)
    # A lever in the tissue's axes does not turn.
    stays = wrench_change(TorqueCentre("tissue"), readings, centre_y=3e-3)
    assert_allclose(stays[[0, 22]], [[0, 0, 0, 0, 0, -6e-3]] * 2, atol=1e-15)


def test_the_weight_left_over_does_not_show_as_long_as_the_gripper_stays_level():
    for turn in ((0.0, 0.0, 0.0), YAW):
        readings = felt(there_and_back(turn_rad=turn), WRENCH)
        change = wrench_change(ToolWeightAndCentre(), readings, mass_error=0.1, centre_error_z=0.01)
        assert_allclose(change, 0.0, atol=1e-15)


def test_the_weight_left_over_is_its_turn_in_the_gripper():
    readings = felt(there_and_back(turn_rad=ROLL), np.zeros(6))
    change = wrench_change(ToolWeight(), readings, mass_error=0.1)[22]
    weight, half = 0.981, np.sqrt(0.5)
    # True weight (0, 0, -w) less the zero, which has turned with the gripper to (0, w, -w)/sqrt 2.
    assert_allclose(change[:3], [0.0, -half * weight, -weight + half * weight], atol=1e-12)
    # At its centre 60 mm above, which has turned to (0, -1, 1) 60 mm / sqrt 2, the weight now tilts the gripper.
    assert_allclose(change[3:], [0.06 * half * weight, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(("form", "sign"), [("lag", 1.0), ("lead", -1.0)])
def test_a_shift_in_time_shows_the_force_of_another_time_and_vanishes_in_a_hold(form, sign):
    readings = felt(there_and_back())
    change = wrench_change(TimeOffset(form), readings, **{form: 2.0})
    # The force goes from 0 to -2 N in 80 s.
    rate = STIFFNESS * 0.02 / 80.0
    assert_allclose(change[1:20, 0], sign * 2.0 * rate)
    assert_allclose(change[22:25, 0], 0.0, atol=1e-15)
    assert_allclose(change[26:45, 0], -sign * 2.0 * rate)


def test_the_delay_is_felt_in_the_axes_that_the_sensor_had_then():
    readings = felt(there_and_back(turn_rad=(0.0, 0.0, np.pi / 2)), np.array([-2.0, 0, 0, 0, 0, 0]))
    late = readings.wrench + wrench_change(TimeOffset("lag"), readings, lag=4.0)
    # One row earlier the gripper stood at 1/20 of its turn less.
    assert_allclose(late[10, :3], Rotation.from_rotvec([0, 0, np.pi / 40]).apply([-2.0, 0, 0]), atol=1e-12)


def test_a_scaled_camera_moves_far_beads_more_than_near_ones():
    readings = felt(there_and_back())
    scaled = CameraScale().readings(readings, {"scale_error": 0.02}).fiducials
    assert_allclose(scaled - readings.fiducials, 0.02 * readings.fiducials)
    in_plane = CameraScaleInPlane().readings(readings, {"scale_error": 0.02}).fiducials
    assert_allclose(in_plane[..., :2], scaled[..., :2])
    assert_array_equal(in_plane[..., 2], readings.fiducials[..., 2])


def test_a_turned_camera_turns_every_bead_about_the_origin():
    readings = felt(there_and_back())
    turned = form("camera_rotation:of_positions").readings(readings, QUARTER_TURN).fiducials
    expected = np.stack(
        [-readings.fiducials[..., 1], readings.fiducials[..., 0], readings.fiducials[..., 2]], -1
    )
    assert_allclose(turned, expected, atol=1e-15)


QUARTER_TURN = {"rotation_x": 0.0, "rotation_y": 0.0, "rotation_z": np.pi / 2}
STRETCHED = {"scale_error": 0.03, "depth_error": 0.01}
OF_FRAMES = [
    (label, values) for label, values in (("camera_scale", STRETCHED), ("camera_rotation", QUARTER_TURN))
]


def form(name: str) -> Effect:
    return next(effect for effect in CATALOGUE if effect.name == name)


@pytest.mark.parametrize(("label", "values"), OF_FRAMES)
def test_a_frame_that_scales_or_turns_about_any_point_leaves_that_point(label, values):
    effect, point = form(f"{label}:about_any_point"), np.array([0.061, 0.019, -0.004])
    shift = -effect.matrix(values) @ point
    given = {**values, **dict(zip(("shift_x", "shift_y", "shift_z"), shift, strict=True))}
    assert_allclose(effect.seen(point, given), point, atol=1e-15)
    beads = felt(there_and_back()).fiducials
    about_origin = effect.seen(beads - point, {**values, "shift_x": 0.0, "shift_y": 0.0, "shift_z": 0.0})
    assert_allclose(effect.seen(beads, given), about_origin + point, atol=1e-15)


@pytest.mark.parametrize(("label", "values"), [("camera_scale", {"scale_error": 0.02}), OF_FRAMES[1]])
def test_cameras_that_saw_the_motion_alone_change_it_and_nothing_at_rest(label, values):
    effect, readings = form(f"{label}:of_the_motion"), felt(there_and_back())
    seen = effect.readings(readings, values).fiducials
    assert_allclose(seen[0], readings.fiducials[0], atol=1e-15)
    motion = readings.fiducials - readings.fiducials[0]
    assert_allclose(seen - seen[0], motion + motion @ effect.matrix(values).T, atol=1e-15)


@pytest.mark.parametrize("label", ["camera_scale", "camera_rotation"])
def test_cameras_that_measured_the_rest_positions_alone_leave_the_readings(label):
    effect, readings = form(f"{label}:of_rest_alone"), felt(there_and_back())
    values = {amplitude.name: 0.01 for amplitude in effect.amplitudes}
    assert effect.readings(readings, values) is readings
    assert effect.misreads_rest
    assert not form(f"{label}:about_any_point").misreads_rest


def test_effects_stand_in_the_order_in_which_they_act_on_the_wrench():
    order = list(dict.fromkeys(effect.label for effect in CATALOGUE if effect.label in SENSOR_LABELS))
    history = [
        "tool_weight",
        "torque_centre",
        "force_frame_rotation",
        "force_crosstalk",
        "force_axis_gain",
        "force_bias",
        "force_drift",
        "time_offset",
    ]
    assert [label for label in order if label in history] == history


def test_a_gain_after_a_turned_mounting_is_not_that_mounting_after_the_gain():
    readings = felt(there_and_back(), WRENCH)
    turn, gain = (ForceFrameRotation(), {"rotation_z": 0.1}), (ForceAxisGain("fx"), {"gain": 0.1})

    def through(*effects):
        result = readings
        for effect, given in effects:
            result = effect.readings(result, with_values(effect, given))
        return result.wrench[0]

    # The sensor turns the force into its axes first and then reads one of them wrong.
    turned = Rotation.from_rotvec([0, 0, -0.1]).apply(WRENCH[:3])
    assert_allclose(through(turn, gain)[:3], turned * [1.1, 1.0, 1.0])
    assert np.abs(through(turn, gain) - through(gain, turn)).max() > 1e-3


def test_names_are_unique_and_every_parameter_has_a_size():
    everything = (*CATALOGUE, *OUTSIDERS)
    names = [effect.name for effect in everything]
    assert len(set(names)) == len(names)
    for effect in everything:
        assert effect.words.endswith(".")
        for amplitude in effect.amplitudes:
            assert 0 < amplitude.smallest < amplitude.scale
            assert amplitude.lower <= 0.0 <= amplitude.upper
