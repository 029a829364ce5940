from dataclasses import replace

import numpy as np
import pytest
from effect_cases import STIFFNESS, at_null, felt, position_change, there_and_back, with_values
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from estimator.effects.catalogue import CATALOGUE
from estimator.effects.motion.gripper_compliance import AxisCompliance, GripperCompliance, RotationCompliance
from estimator.effects.motion.gripper_slip import CreepingSlip, GripperJump, GripperSlip, SlipByAxis
from estimator.effects.motion.motion_direction import MotionDirection, PoseDirection
from estimator.effects.motion.motion_scale import MotionScale, PoseScale
from estimator.effects.motion.robot_backlash import RobotBacklash

MOTION_LABELS = (
    "motion_scale",
    "motion_direction",
    "robot_backlash",
    "gripper_compliance",
    "gripper_slip",
)
OF_MOTION = [effect for effect in CATALOGUE if effect.label in MOTION_LABELS]
ROLL = (np.pi / 4, 0.0, 0.0)
YAW = (0.0, 0.0, np.pi / 6)
OUT, STANDING, BACK = slice(0, 21), slice(21, 26), slice(26, 46)


def turn_change(effect, motion, **given):
    """By how much an effect turns the gripper (n, 3), rad."""
    turned = effect.motion(motion, with_values(effect, given)).rotation
    return (turned * motion.rotation.inv()).as_rotvec()


def shaken(motion, seed=0):
    """The motion with the noise of its reported position."""
    noise = np.random.default_rng(seed).normal(
        0, motion.experiment.sensor.position_std, motion.position.shape
    )
    return motion.moved(motion.position + noise)


@pytest.mark.parametrize("effect", OF_MOTION, ids=lambda effect: effect.name)
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), ROLL, YAW])
def test_at_its_null_an_effect_of_motion_leaves_the_gripper_where_it_is(effect, turn):
    motion = shaken(there_and_back(turn_rad=turn))
    for constants in effect.starts([felt(motion)]):
        moved = effect.motion(motion, {**constants, **at_null(effect)})
        assert_allclose(moved.position, motion.position, rtol=0, atol=1e-15)
        assert_allclose((moved.rotation * motion.rotation.inv()).as_rotvec(), 0.0, atol=1e-14)


@pytest.mark.parametrize("effect", OF_MOTION, ids=lambda effect: effect.name)
def test_an_effect_of_motion_leaves_its_null_without_a_kink(effect):
    motion = shaken(there_and_back(turn_rad=YAW))
    constants = effect.starts([felt(motion)])[0]
    for amplitude in effect.amplitudes:
        step = 1e-3 * amplitude.scale

        def change(size, name=amplitude.name):
            given = {**constants, name: size}
            return np.hstack([position_change(effect, motion, **given), turn_change(effect, motion, **given)])

        once, twice = change(step), change(2 * step)
        assert np.linalg.norm(twice - 2 * once) <= 1e-3 * np.linalg.norm(once) + 1e-14
        if amplitude.lower < 0:
            assert np.linalg.norm(once + change(-step)) <= 1e-3 * np.linalg.norm(once) + 1e-14


def test_backlash_that_was_taken_up_loses_its_width_on_the_way_back_only():
    change = position_change(RobotBacklash("translation", "taken_up"), there_and_back(), width=4e-4)
    assert_allclose(change[:26], 0.0, atol=1e-15)
    assert_allclose(change[26:, 0], 4e-4)


def test_centred_backlash_loses_half_its_width_either_way():
    change = position_change(RobotBacklash("translation", "centred"), there_and_back(), width=4e-4)
    assert_allclose(change[1:26, 0], -2e-4)
    assert_allclose(change[26:, 0], 2e-4)


@pytest.mark.parametrize(("start", "lost_m"), [(1.0, 0.0), (0.0, 2e-4), (-1.0, 4e-4), (0.6, 0.8e-4)])
def test_backlash_loses_on_the_way_out_what_is_not_taken_up_at_rest_and_all_of_it_back(start, lost_m):
    effect = RobotBacklash("translation", "anywhere")
    change = position_change(effect, there_and_back(), width=4e-4, start=start)
    assert_allclose(change[0], 0.0, atol=1e-15)
    assert_allclose(change[1:26, 0], -lost_m, atol=1e-15)
    assert_allclose(change[26:, 0], 4e-4 - lost_m)


def test_noise_of_a_standing_gripper_reverses_nothing():
    change = position_change(RobotBacklash("translation", "taken_up"), shaken(there_and_back()), width=1e-4)
    assert_allclose(change[20:26], np.tile(change[20], (6, 1)), atol=1e-15)
    assert_allclose(change[:26, 0], 0.0, atol=0.5e-5)
    assert_allclose(change[26:, 0], 1e-4, atol=0.5e-5)


def test_a_turning_gripper_loses_turn_where_its_turning_reverses():
    effect, motion = RobotBacklash("rotation", "taken_up"), there_and_back(turn_rad=YAW)
    change = turn_change(effect, motion, width=0.01)
    assert_allclose(change[:26], 0.0, atol=1e-12)
    assert_allclose(change[26:, 2], 0.01)


def test_scaled_motion_is_proportional_to_the_displacement_from_rest():
    motion = there_and_back(turn_rad=YAW)
    displacement = motion.position - motion.experiment.grasp.centre
    assert_allclose(position_change(MotionScale(), motion, scale_error=0.02), 0.02 * displacement, atol=1e-16)
    assert_allclose(turn_change(MotionScale(), motion, scale_error=0.02), 0.0, atol=1e-14)
    assert_allclose(turn_change(PoseScale(), motion, scale_error=0.02)[22], 0.02 * np.array(YAW), atol=1e-14)


def test_a_turned_direction_of_motion_leads_sideways():
    change = position_change(MotionDirection(), there_and_back(), rotation_z=0.03)
    assert_allclose(change[22], [0.02 * (np.cos(0.03) - 1), 0.02 * np.sin(0.03), 0.0], atol=1e-15)


def test_a_turned_registration_turns_the_axis_of_rotation_too():
    motion = there_and_back(turn_rad=ROLL)
    moved = PoseDirection().motion(motion, with_values(PoseDirection(), {"rotation_z": 0.1}))
    expected = Rotation.from_rotvec([0, 0, 0.1]).apply(ROLL)
    assert_allclose(moved.rotation[22].as_rotvec(), expected, atol=1e-12)
    assert_allclose(moved.rotation[0].magnitude(), 0.0, atol=1e-12)


def test_the_gripper_yields_towards_the_tissue_that_pulls_it():
    change = position_change(GripperCompliance(), there_and_back(), compliance=3e-4)
    assert_allclose(change[22], [-6e-4, 0.0, 0.0])
    assert_allclose(change[0], 0.0)


def test_a_gripper_that_yields_along_one_of_its_axes_moves_along_it_wherever_it_points():
    motion = there_and_back(turn_rad=(0.0, 0.0, np.pi / 4))
    change = position_change(AxisCompliance(), motion, compliance_x=1e-3)
    assert_allclose(change[22], [-1e-3, -1e-3, 0.0], atol=1e-15)


def test_under_torque_the_gripper_turns_with_it():
    motion = there_and_back()
    load = motion.load.copy()
    load[:, 5] = 0.01
    change = turn_change(RotationCompliance(), replace(motion, load=load), rotation_compliance=2.0)
    assert_allclose(change, np.tile([0, 0, 0.02], (46, 1)), atol=1e-14)


def slipped(motion, slip_per_force=0.01, threshold=1.2):
    """A spring of tissue held by friction: the load as it is when the tissue slides, and the slip (n,)."""
    trial = -motion.load[:, 0]
    slip = np.maximum.accumulate(slip_per_force * np.maximum(trial - threshold, 0.0))
    load = motion.load.copy()
    load[:, 0] = -(trial - STIFFNESS * slip)
    return replace(motion, load=load), slip


@pytest.mark.parametrize("slip_per_force", [0.002, 0.0098])
def test_slip_is_told_from_a_load_that_hardly_grows_beyond_the_threshold(slip_per_force):
    motion, slip = slipped(there_and_back(), slip_per_force)
    change = position_change(GripperSlip(), motion, slip_per_force=slip_per_force, threshold=1.2)
    assert_allclose(change[:, 0], -slip, atol=0.02 * slip.max())


def test_slipped_tissue_stays_where_it_is_in_the_gripper_when_that_turns_back():
    motion, _ = slipped(there_and_back(turn_rad=(0.0, 0.0, np.pi / 4)), 0.0098)
    change = position_change(GripperSlip(), motion, slip_per_force=0.0098, threshold=1.2)
    in_gripper = motion.rotation.inv().apply(change)
    assert_allclose(in_gripper[26:], np.tile(in_gripper[20], (20, 1)), atol=1e-9)
    assert np.linalg.norm(in_gripper[20]) > 6e-3


def test_jaws_in_which_all_axes_slide_alike_are_plain_ones():
    motion, _ = slipped(there_and_back(turn_rad=(0.0, 0.0, np.pi / 4)))
    alike = {f"slip_per_force_{axis}": 0.0098 for axis in "xyz"}
    plain = position_change(GripperSlip(), motion, slip_per_force=0.0098, threshold=1.2)
    assert_allclose(position_change(SlipByAxis(), motion, **alike, threshold=1.2), plain, atol=1e-12)


def test_jaws_that_are_open_along_one_axis_let_the_tissue_slide_along_that_alone():
    motion, slip = slipped(there_and_back())
    oblique = replace(motion, load=motion.load + motion.load[:, [1, 0, 2, 3, 4, 5]])
    change = position_change(SlipByAxis(), oblique, slip_per_force_y=0.01, threshold=1.2)
    assert_allclose(change[:, [0, 2]], 0.0, atol=1e-15)
    assert_allclose(change[:, 1], -slip / np.sqrt(2), atol=1e-12)


def test_tissue_that_has_turned_in_the_jaws_stays_turned():
    motion, _ = slipped(there_and_back())
    twisted = replace(motion, load=motion.load + np.array([0, 0, 0, 0, 0, 1e-3]))
    values = {**dict.fromkeys((f"slip_per_force_{axis}" for axis in "xyz"), 0.0), "turn_per_force": 0.1}
    turned = SlipByAxis().motion(twisted, {**values, "threshold": 1.2}).rotation.as_rotvec()
    largest = np.linalg.norm(twisted.trial[:, :3], axis=1).max()
    assert_allclose(turned[-1], [0.0, 0.0, 0.1 * (largest - 1.2)], atol=1e-12)
    assert_allclose(turned[0], 0.0, atol=1e-15)


def test_noise_does_not_ratchet_the_slip_while_the_gripper_stands():
    motion, _ = slipped(there_and_back())
    change = position_change(GripperSlip(), shaken(motion), slip_per_force=0.01, threshold=1.2)
    assert_allclose(change[21:26], np.tile(change[20], (5, 1)), atol=1e-12)


def test_a_threshold_that_is_never_reached_lets_nothing_slip():
    for effect in (GripperSlip(), CreepingSlip(), GripperJump()):
        given = {amplitude.name: amplitude.scale for amplitude in effect.amplitudes}
        given |= {constant.name: constant.lower for constant in effect.constants} | {"threshold": 2.5}
        assert_allclose(position_change(effect, there_and_back(), **given), 0.0, atol=1e-15)


def test_a_jump_slips_its_whole_length_at_the_threshold():
    change = position_change(GripperJump(), there_and_back(), slip=1e-3, threshold=1.25)
    assert_allclose(change[:13], 0.0, atol=1e-12)
    assert_allclose(change[13:, 0], -1e-3)


def test_a_jump_may_come_at_every_station_of_the_way_out():
    motion = there_and_back()
    levels = np.linalg.norm(motion.load[OUT, :3], axis=1)
    thresholds = [start["threshold"] for start in GripperJump().starts([felt(motion)])]
    assert_allclose(thresholds, (levels[1:] + levels[:-1]) / 2)


CREEPING = {"slip_per_force": 0.008, "threshold": 1.2}


def test_without_drag_slip_does_not_creep():
    motion = there_and_back()
    at_once = position_change(GripperSlip(), motion, **CREEPING)
    assert_allclose(
        position_change(CreepingSlip(), motion, **CREEPING, time_constant=0.05, power=1.0),
        at_once,
        atol=1e-12,
    )


def test_slip_against_a_drag_is_that_of_a_spring_a_slider_and_a_dashpot():
    """The balance of forces integrated by another hand: what pulls beyond the threshold moves the dashpot."""
    motion = there_and_back()
    stiffness_and_hardening, drag = 1.0 / CREEPING["slip_per_force"], 2500.0
    pull = np.abs(motion.trial[:, 0])

    def speed(time_s, slip):
        # A time_point's load acts from the moment that the gripper leaves the one before.
        acting = pull[np.searchsorted(motion.time, time_s)]
        return np.maximum(acting - CREEPING["threshold"] - stiffness_and_hardening * slip, 0.0) / drag

    slip = solve_ivp(
        speed, motion.time[[0, -1]], [0.0], t_eval=motion.time, max_step=0.1, rtol=1e-8, atol=1e-12
    ).y[0]
    given = {**CREEPING, "time_constant": drag / stiffness_and_hardening, "power": 1.0}
    assert_allclose(position_change(CreepingSlip(), motion, **given)[:, 0], -slip, atol=5e-3 * slip.max())
    assert slip[STANDING][-1] > 1.2 * slip[STANDING][0]


def test_what_the_robot_does_comes_before_what_the_gripper_does():
    order = list(dict.fromkeys(effect.label for effect in OF_MOTION))
    assert order == list(MOTION_LABELS)
