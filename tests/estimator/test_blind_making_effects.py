"""The physics of every effect that the maker plants: its sign, and that it vanishes with its size."""

import numpy as np
import pytest
from blind_scenes import (
    BACK,
    BASELINE,
    BEADS,
    FULL,
    HALF,
    HELD,
    OBLIQUE,
    PULL,
    REST,
    THREE,
    TRAVEL_M,
    Seen,
    baseline,
    drawn,
    see,
    with_effect,
)

from estimator.blind.making.effects import outside
from estimator.blind.making.effects.catalogue import FORMS, GROUP_OF, UNKNOWN, form_named
from estimator.blind.making.effects.motion import play
from estimator.blind.making.scenes.retraction import Rows
from estimator.blind.making.scenes.scene import Form, Scene

ALL = [
    *((label, form) for label, forms in FORMS.items() for form in forms),
    *((UNKNOWN, form) for form in outside.FORMS.values()),
]
SIZED = [(label, form) for label, form in ALL if form.range[0] < form.range[1]]
# Slip, failure and clipping begin at a threshold, and a threshold at size zero is not nothing.
THRESHOLDS = {"failing_glue", "sliding", "creeping", "clipped_force", "jammed_wrist"}
# These come with a mesh of their own, which differs from the baseline's on this coarse one.
REMESHED = {"inhomogeneity", "anchor_debonding", "grasp_misplacement"}
REMESHED_OUTSIDE = {"air_pocket", "cut", "sticky_patch", "tearing"}


def named(pairs: list[tuple[str, Form]]) -> list[str]:
    return [f"{label}-{form.name}" for label, form in pairs]


def sigmas(seen: Seen, reference: Seen) -> float:
    """Length of a difference in standard deviations of the noise, bead positions from the first row on."""
    squares = 0.0
    for one, other in zip(seen.readings, reference.readings, strict=True):
        wrench = (one.wrench - other.wrench) / np.repeat([0.02, 5e-4], 3)
        beads = (one.beads - other.beads) / 5e-5
        squares += float((wrench**2).sum() + (beads**2).sum())
    return float(np.sqrt(squares))


def experiments_for(form: Form) -> tuple[Rows, ...]:
    """All three where instruments alone are at fault, which costs nothing; else one that shows everything."""
    instruments = drawn(form).change(Scene(BASELINE)).mechanics is BASELINE
    return THREE if instruments else OBLIQUE


@pytest.mark.parametrize(("label", "form"), SIZED, ids=named(SIZED))
def test_an_effect_shows_at_its_usual_size(label: str, form: Form) -> None:
    experiments = experiments_for(form)
    assert sigmas(with_effect(form, min(1.0, form.range[1]), experiments), baseline(experiments)) > 1.0


VANISHING = [
    (label, form)
    for label, form in SIZED
    if form.name not in THRESHOLDS | REMESHED_OUTSIDE and label not in REMESHED
]


@pytest.mark.parametrize(("label", "form"), VANISHING, ids=named(VANISHING))
def test_an_effect_vanishes_with_its_size(label: str, form: Form) -> None:
    experiments = experiments_for(form)
    assert sigmas(with_effect(form, 1e-3, experiments), baseline(experiments)) < 2.5


def test_every_label_has_a_group_and_all_but_one_have_two_forms() -> None:
    assert set(GROUP_OF) == set(FORMS)
    assert [label for label, forms in FORMS.items() if len(forms) < 2] == ["thickness_error"]
    assert len(FORMS) == 32
    assert len(outside.FORMS) >= 8


@pytest.mark.parametrize("name", ["yeoh", "gent", "exponential"])
def test_stiffening_grows_with_the_pull(name: str) -> None:
    ratio = with_effect(form_named("strain_stiffening", name)).fx[1:3] / baseline().fx[1:3]
    assert 1.0 < ratio[0] < ratio[1]


def test_stress_relaxes_in_a_hold_towards_the_slow_stiffness() -> None:
    seen = with_effect(form_named("viscoelasticity", "one_term_relaxed"))
    assert seen.fx[FULL] < seen.fx[HELD] < baseline().fx[HELD]
    assert abs(seen.fx[BACK]) < abs(seen.fx[HALF])


def test_an_instantaneous_modulus_bounds_the_force_from_above() -> None:
    seen = with_effect(form_named("viscoelasticity", "one_term_instantaneous"))
    assert baseline().fx[FULL] < seen.fx[FULL] < seen.fx[HELD]


def test_pseudo_elastic_tissue_is_virgin_on_the_way_out_and_softer_on_the_way_back() -> None:
    seen = with_effect(form_named("stress_softening", "pseudo_elastic"))
    assert seen.fx[FULL] == pytest.approx(baseline().fx[FULL], rel=1e-3)
    assert abs(seen.fx[BACK]) < 0.97 * abs(baseline().fx[BACK])


def test_damage_lasts_into_the_next_experiment() -> None:
    scene = drawn(form_named("stress_softening", "continuum_damage")).change(Scene(BASELINE))
    first, second = (reading.wrench[HALF, 0] for reading in see(scene, (THREE[0], THREE[0])).readings)
    assert abs(second) < abs(first)


def test_a_set_leaves_the_tissue_longer() -> None:
    seen = with_effect(form_named("permanent_set", "at_once"))
    assert abs(seen.fx[BACK]) < abs(baseline().fx[BACK])


def test_a_stiff_region_raises_and_a_soft_one_lowers_the_force() -> None:
    stiff = with_effect(form_named("inhomogeneity", "stiff_box"))
    soft = with_effect(form_named("inhomogeneity", "soft_box"))
    assert abs(soft.fx[FULL]) < abs(baseline().fx[FULL]) < abs(stiff.fx[FULL])


def test_a_soft_anchor_gives_and_lets_beads_near_it_follow() -> None:
    seen = with_effect(form_named("anchor_compliance", "even_layer"))
    assert abs(seen.fx[FULL]) < abs(baseline().fx[FULL])
    assert seen.shifts[FULL, 0, 0] > 1.1 * baseline().shifts[FULL, 0, 0]


def test_a_free_end_of_the_anchor_pulls_the_gripper_sideways() -> None:
    seen = with_effect(form_named("anchor_debonding", "free_end"))
    assert abs(seen.fx[FULL]) < abs(baseline().fx[FULL])
    assert np.abs(seen.readings[0].wrench[FULL, [1, 5]]).max() > 1e-3
    assert np.abs(baseline().readings[0].wrench[FULL, [1, 5]]).max() < 1e-4


def test_failing_glue_does_not_mend() -> None:
    scene = drawn(form_named("anchor_debonding", "failing_glue"), 3.0).change(Scene(BASELINE))
    first, second = (reading.wrench[:, 0] for reading in see(scene, (PULL[0], PULL[0])).readings)
    assert abs(first[FULL]) < abs(baseline().fx[FULL])
    assert abs(first[BACK]) < abs(first[HALF])
    assert abs(second[HALF]) < abs(first[HALF])


def test_jaws_let_go_at_their_threshold_and_do_not_slide_back() -> None:
    effect = drawn(form_named("gripper_slip", "sliding"), 4.0)
    seen = see(effect.change(Scene(BASELINE)))
    threshold, hardening = effect.parameters["threshold_force"], effect.parameters["hardening"]
    assert threshold < abs(seen.fx[FULL]) < threshold + hardening * TRAVEL_M
    assert abs(seen.fx[BACK]) < abs(seen.fx[HALF])


def test_a_jump_happens_once() -> None:
    effect = drawn(form_named("gripper_slip", "jump"), 1.5)
    seen = see(effect.change(Scene(BASELINE)), (THREE[0],))
    assert abs(seen.fx[HELD]) < abs(baseline().fx[HELD])


def test_an_elastic_grip_lags_by_its_compliance_times_the_force() -> None:
    effect = drawn(form_named("gripper_compliance", "translation"))
    seen = see(effect.change(Scene(BASELINE)))
    yielded = effect.parameters["m_per_N"][0] * abs(seen.fx[FULL])
    slope = abs(baseline().fx[FULL] - baseline().fx[HALF]) / (TRAVEL_M / 2)
    assert abs(baseline().fx[FULL]) - abs(seen.fx[FULL]) == pytest.approx(yielded * slope, rel=0.06)


def test_a_grasp_nearer_to_the_anchor_pulls_harder() -> None:
    form = form_named("grasp_misplacement", "shift_with_centre")
    seeds = {seed: drawn(form, 1.0, seed).parameters["shift"][0] for seed in range(20)}
    nearest = min(seeds, key=lambda seed: seeds[seed])
    seen = see(drawn(form, 1.0, nearest).change(Scene(BASELINE)))
    assert abs(seen.fx[FULL]) > abs(baseline().fx[FULL])


def test_friction_resists_the_way_out_and_the_way_back() -> None:
    seen = with_effect(form_named("support_friction", "coulomb"))
    assert seen.fx[HALF] < baseline().fx[HALF] < 0
    assert seen.fx[BACK] > baseline().fx[BACK]


def test_a_hanging_phantom_sags_and_its_sensor_reads_zero_at_first() -> None:
    seen = with_effect(form_named("gravity_sag", "hanging"))
    assert seen.shifts[REST, :, 2].min() < -1e-3
    assert not np.any(seen.readings[0].wrench[REST])


def test_force_is_in_proportion_to_thickness() -> None:
    effect = drawn(form_named("thickness_error", "uniform"))
    seen = see(effect.change(Scene(BASELINE)))
    assert seen.fx[FULL] / baseline().fx[FULL] == pytest.approx(
        1 + effect.parameters["relative_error"], rel=0.01
    )


def test_mounting_tension_shows_in_beads_but_not_in_the_zeroed_force() -> None:
    seen = with_effect(form_named("prestretch", "along_x"))
    assert seen.shifts[REST, :, 0].max() > 3e-4
    assert not np.any(seen.readings[0].wrench[REST])


def test_a_play_loses_its_width_at_the_reversal() -> None:
    np.testing.assert_allclose(
        play(np.array([0.0, 1.0, 2.0, 1.9, 1.0]), 0.4, -0.2), [-0.2, 0.8, 1.8, 1.8, 1.2]
    )


def test_backlash_taken_up_at_first_shows_only_on_the_way_back() -> None:
    seen = with_effect(form_named("robot_backlash", "taken_up"))
    np.testing.assert_allclose(seen.fx[: HELD + 1], baseline().fx[: HELD + 1], atol=1e-4)
    assert seen.fx[BACK] < baseline().fx[BACK] - 0.01


def test_tool_weight_shows_only_where_the_gripper_turns_it() -> None:
    seen = with_effect(form_named("tool_weight", "mass"), 1.0, THREE)
    pull, about_z, about_x = (
        np.abs(one.wrench - two.wrench).max()
        for one, two in zip(seen.readings, baseline(THREE).readings, strict=True)
    )
    assert max(pull, about_z) < 1e-9 < 0.05 < about_x


def test_a_late_force_lags_on_the_way_out_and_agrees_after_a_hold() -> None:
    effect = drawn(form_named("time_offset", "lags"))
    seen = see(effect.change(Scene(BASELINE)))
    share = effect.parameters["force_lag"] / 0.5
    rise = baseline().fx[FULL] - baseline().fx[HALF]
    assert seen.fx[FULL] == pytest.approx(baseline().fx[FULL] - share * rise)
    assert seen.fx[HELD] == pytest.approx(baseline().fx[HELD])


def test_cross_talk_leaks_in_proportion() -> None:
    effect = drawn(form_named("force_crosstalk", "force_into_force"))
    seen = see(effect.change(Scene(BASELINE))).readings[0].wrench
    sink = {"fy": 1, "fz": 2}[effect.parameters["into"]]
    leaked = seen[:, sink] - baseline().readings[0].wrench[:, sink]
    np.testing.assert_allclose(leaked, effect.parameters["leak"] * baseline().fx, atol=1e-9)


def test_a_turned_sensor_keeps_the_size_of_the_force() -> None:
    seen = with_effect(form_named("force_frame_rotation", "about_any_axis")).readings[0].wrench
    before = baseline().readings[0].wrench
    np.testing.assert_allclose(
        np.linalg.norm(seen[:, :3], axis=1), np.linalg.norm(before[:, :3], axis=1), atol=1e-9
    )
    assert np.abs(seen - before).max() > 0.01


def test_exchanged_fiducials_are_exchanged_from_an_instant_on() -> None:
    effect = drawn(form_named("fiducial_mislabel", "any_two_all_experiments"))
    a, b = effect.parameters["fiducials"]
    seen = see(effect.change(Scene(BASELINE))).readings[0].beads
    true = baseline().readings[0].beads
    np.testing.assert_array_equal(seen[REST], true[REST])
    np.testing.assert_array_equal(seen[BACK, [a, b]], true[BACK, [b, a]])


def test_a_scaled_camera_scales_about_the_origin() -> None:
    effect = drawn(form_named("camera_scale", "uniform"))
    seen = see(effect.change(Scene(BASELINE)))
    np.testing.assert_allclose(seen.readings[0].beads[REST], effect.parameters["scale"] * BEADS, atol=1e-9)


def test_shrinkage_tightens_the_later_experiments() -> None:
    form = outside.FORMS["thermal_shrinkage"]
    seen = with_effect(form, 1.0, THREE)
    each = drawn(form).parameters["linear_strain_per_experiment"]
    np.testing.assert_allclose(seen.readings[0].wrench, baseline(THREE).readings[0].wrench, atol=1e-5)
    harder = abs(seen.readings[1].wrench[FULL, 0]) - abs(baseline(THREE).readings[1].wrench[FULL, 0])
    assert harder * each < 0


def test_a_cut_softens_and_a_sticky_patch_stiffens() -> None:
    cut, patch = (with_effect(outside.FORMS[name], 2.0) for name in ("cut", "sticky_patch"))
    assert abs(cut.fx[FULL]) < abs(baseline().fx[FULL]) < abs(patch.fx[FULL])


def test_a_tear_does_not_heal() -> None:
    seen = with_effect(outside.FORMS["tearing"], 2.0)
    assert abs(seen.fx[BACK]) < abs(seen.fx[HALF])


def test_an_air_pocket_lifts_the_beads_above_it() -> None:
    effect = drawn(outside.FORMS["air_pocket"], 1.0)
    seen = see(effect.change(Scene(BASELINE)))
    lifted = (seen.readings[0].beads - baseline().readings[0].beads)[REST]
    above = int(np.argmin(np.linalg.norm(BEADS[:, :2] - effect.where["centre"][:2], axis=1)))
    assert lifted[above, 2] > 0.5 * lifted[:, 2].max() > 1e-5


def test_stale_images_show_the_beads_behind_while_they_move() -> None:
    seen = with_effect(outside.FORMS["stale_images"], 2.0, THREE)
    pairs = list(zip(seen.readings, baseline(THREE).readings, strict=True))
    stale = np.concatenate([np.abs(one.beads - true.beads).max(axis=(1, 2)) > 1e-6 for one, true in pairs])
    assert 0.0 < stale.mean() < 0.5
    for one, true in pairs:
        np.testing.assert_array_equal(one.wrench, true.wrench)
