"""Effects of the tissue that add a stress: fibres, relaxation, softening and set."""

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK
from scipy.spatial.transform import Rotation
from tissue_effects import (
    PROBLEM,
    TISSUE,
    driven,
    force_change,
    pulled_to,
    response_to,
    smooth_field,
    stiffness_of,
    times_change,
)

from estimator.effects.effect import Effect
from estimator.effects.tissue.anisotropy import ANISOTROPY
from estimator.effects.tissue.permanent_set import PERMANENT_SET
from estimator.effects.tissue.stress_softening import STRESS_SOFTENING
from estimator.effects.tissue.viscoelasticity import VISCOELASTICITY, Viscoelasticity
from estimator.fem.assembly.body import forces_of_stress, nodal_forces, stress_of
from estimator.fem.assembly.stress_kernels import second_piola
from estimator.fem.terms.fibres import Fibres
from estimator.fem.terms.relaxation import RelaxingPart
from estimator.fem.terms.softening import ContinuumDamage
from estimator.fem.terms.stress_terms import isochoric_energy
from estimator.fem.terms.term import Term
from estimator.materials.material import Material, make_material
from estimator.materials.veronda_westmann import VerondaWestmann

FloatArray = NDArray[np.float64]

BOTH_WAYS, TENSION_ONLY, DISPERSED, *_ = ANISOTROPY
ONE_TERM, TWO_TERMS, WHOLE, *_ = VISCOELASTICITY
PSEUDO_ELASTIC, DAMAGE, ISOCHORIC, *_, DAMAGE_WHOLE = STRESS_SOFTENING
EXPONENTIAL = make_material(VerondaWestmann(), 1e4, 0.45, (0.8, 0.3))

ONE_TIME = {"relaxing_share_1": 0.4, "relaxation_time_1": 10.0}
TWO_TIMES = {
    "relaxing_share_1": 0.2,
    "relaxation_time_1": 3.0,
    "relaxing_share_2": 0.3,
    "relaxation_time_2": 30.0,
}
WIDTHS: list[tuple[Effect, dict[str, float]]] = [
    (PSEUDO_ELASTIC, {"depth": 0.3, "width_over_modulus": 0.01, "relative_width": 0.0}),
    (PSEUDO_ELASTIC, {"depth": 0.3, "width_over_modulus": 1e-4, "relative_width": 0.5}),
    (PSEUDO_ELASTIC, {"depth": 0.3, "width_over_modulus": 0.005, "relative_width": 0.2}),
]
EXPONENTIAL_DAMAGE = {"depth": 0.3, "width_over_modulus": 0.01, "order": 1.0}
LOST_AT_ONCE = {"depth": 0.3, "width_over_modulus": 1e-12, "order": 1.0}
PRESENT: list[tuple[Effect, dict[str, float]]] = [
    (BOTH_WAYS, {"fibre_modulus_over_modulus": 0.3, "fibre_angle": 0.6}),
    (TENSION_ONLY, {"fibre_modulus_over_modulus": 0.3, "fibre_angle": 0.6, "fibre_stiffening": 0.8}),
    (
        DISPERSED,
        {"fibre_modulus_over_modulus": 0.3, "fibre_angle": 0.6, "fibre_stiffening": 0.8, "dispersion": 0.1},
    ),
    (ONE_TERM, ONE_TIME),
    (TWO_TERMS, TWO_TIMES),
    (WHOLE, ONE_TIME),
    *WIDTHS,
    (DAMAGE, EXPONENTIAL_DAMAGE),
    (DAMAGE, {**EXPONENTIAL_DAMAGE, "order": 0.5}),
    (ISOCHORIC, WIDTHS[0][1]),
    (DAMAGE_WHOLE, EXPONENTIAL_DAMAGE),
    (PERMANENT_SET, {"share": 0.1}),
]
NAMES = [effect.name for effect, _ in PRESENT]
each_effect = pytest.mark.parametrize(("effect", "values"), PRESENT, ids=NAMES)


def term_of(effect: Effect, values: dict[str, float], material: Material = TISSUE) -> Term:
    (term,) = effect.terms(PROBLEM, material, REFERENCE_BLOCK, values)
    return term


def remembering(effect: Effect, values: dict[str, float], material: Material) -> Term:
    """The term two seconds after a state with a strain of some 15 %."""
    past = smooth_field(0.25, seed=2)
    term = term_of(effect, values, material).starting_after(5.0)
    return term.after(past, response_to(past, material)).starting_after(2.0)


@each_effect
def test_an_effect_at_its_null_adds_no_term(effect: Effect, values: dict[str, float]) -> None:
    null = {**values, **{amplitude.name: 0.0 for amplitude in effect.amplitudes}}
    assert effect.terms(PROBLEM, TISSUE, REFERENCE_BLOCK, null) == ()


@each_effect
def test_virgin_tissue_at_rest_bears_no_force(effect: Effect, values: dict[str, float]) -> None:
    rest = np.zeros_like(PROBLEM.body.mesh.points)
    forces = term_of(effect, values).starting_after(1.0).forces(rest, response_to(rest))
    assert np.abs(forces).max() < 1e-12


@each_effect
@pytest.mark.parametrize("material", [TISSUE, EXPONENTIAL], ids=["neo_hookean", "exponential"])
def test_forces_turn_with_the_tissue(effect: Effect, values: dict[str, float], material: Material) -> None:
    term = remembering(effect, values, material)
    field, points = smooth_field(0.1), PROBLEM.body.mesh.points
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5])
    turned = turn.apply(points + field) - points
    forces = term.forces(field, response_to(field, material))
    assert np.abs(forces).max() > 1e-5
    np.testing.assert_allclose(
        term.forces(turned, response_to(turned, material)),
        turn.apply(forces),
        atol=1e-9 * np.abs(forces).max(),
    )
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-12)


@pytest.mark.parametrize(("effect", "values"), PRESENT[:-2], ids=NAMES[:-2])
@pytest.mark.parametrize("material", [TISSUE, EXPONENTIAL], ids=["neo_hookean", "exponential"])
def test_the_stiffness_is_the_derivative_of_the_forces(
    effect: Effect, values: dict[str, float], material: Material
) -> None:
    term = remembering(effect, values, material)
    field, change = smooth_field(0.1), smooth_field(1.0, seed=3)
    expected = force_change(term, field, change, material)
    found = stiffness_of(term, field, material)
    np.testing.assert_allclose(times_change(found, change), expected, atol=1e-6 * np.abs(expected).max())


def test_the_stiffness_of_a_softened_whole_is_the_derivative_where_it_is_softened_evenly() -> None:
    term = remembering(DAMAGE_WHOLE, LOST_AT_ONCE, TISSUE)
    field, change = smooth_field(0.1), smooth_field(1.0, seed=3)
    expected = force_change(term, field, change, TISSUE)
    found = stiffness_of(term, field)
    np.testing.assert_allclose(times_change(found, change), expected, atol=1e-6 * np.abs(expected).max())


def test_the_stiffness_of_a_set_is_the_symmetric_part_of_the_derivative() -> None:
    term = remembering(PERMANENT_SET, {"share": 0.1}, TISSUE)
    field, change = smooth_field(0.1), smooth_field(1.0, seed=3)
    found = stiffness_of(term, field)
    along = float(np.sum(change * times_change(found, change)))
    assert along == pytest.approx(float(np.sum(change * force_change(term, field, change, TISSUE))), rel=1e-6)


def test_forces_of_fibres_are_the_gradient_of_their_energy() -> None:
    fibres = Fibres(PROBLEM.body, 3e3, np.array([0.6, 0.8, 0.0]))
    field, change, step = smooth_field(0.1), smooth_field(1.0, seed=3), 1e-5
    ahead, back = (fibres.energy(response_to(field + sign * step * change)) for sign in (1, -1))
    work = float(np.sum(fibres.forces(field, response_to(field)) * change))
    assert work == pytest.approx((ahead - back) / (2 * step), rel=1e-6)


def test_fibres_add_four_times_their_modulus_along_themselves_and_nothing_across() -> None:
    points = PROBLEM.body.mesh.points
    strain = 1e-5
    stretched = np.outer(strain * points[:, 0], [1.0, 0.0, 0.0])
    volume = PROBLEM.body.volume.sum()

    def stress(angle: float) -> float:
        term = term_of(BOTH_WAYS, {"fibre_modulus_over_modulus": 0.1, "fibre_angle": angle})
        return float(np.sum(term.forces(stretched, response_to(stretched)) * stretched)) / (strain * volume)

    assert stress(0.0) == pytest.approx(4 * 0.1 * TISSUE.youngs_modulus * strain, rel=1e-3)
    assert abs(stress(np.pi / 2)) < 1e-6 * stress(0.0)


def test_fibres_of_tension_alone_bear_nothing_across_a_stretch_and_stiffen_along_it() -> None:
    values = {"fibre_modulus_over_modulus": 0.3, "fibre_angle": 0.0, "fibre_stiffening": 0.8}
    points = PROBLEM.body.mesh.points
    longer, shorter = points * [0.25, -0.1, -0.1], points * [-0.05, 0.02, 0.02]
    both, tension = (term_of(effect, values) for effect in (BOTH_WAYS, TENSION_ONLY))
    extension = 1.25**2 - 1.0
    np.testing.assert_allclose(
        tension.forces(longer, response_to(longer)),
        np.exp(0.8 * extension**2) * both.forces(longer, response_to(longer)),
        atol=1e-12,
    )
    assert np.abs(both.forces(shorter, response_to(shorter))).max() > 0.0
    assert np.abs(tension.forces(shorter, response_to(shorter))).max() == 0.0


def test_fibres_that_do_not_scatter_are_those_of_one_direction_and_wholly_scattered_ones_have_none() -> None:
    field = smooth_field(0.15)
    values = {"fibre_modulus_over_modulus": 0.3, "fibre_angle": 0.6, "fibre_stiffening": 0.8}

    def forces(effect: Effect, **more: float) -> FloatArray:
        return term_of(effect, {**values, **more}).forces(field, response_to(field))

    alike = forces(TENSION_ONLY)
    np.testing.assert_allclose(forces(DISPERSED, dispersion=0.0), alike, atol=1e-12 * np.abs(alike).max())
    scattered = [forces(DISPERSED, dispersion=1 / 3, fibre_angle=angle) for angle in (0.0, 1.2)]
    np.testing.assert_allclose(*scattered, atol=1e-12 * np.abs(scattered[0]).max())


def test_scattered_fibres_bear_across_their_mean_direction_what_single_ones_do_not() -> None:
    points = PROBLEM.body.mesh.points
    across = points * [-0.05, 0.2, -0.05]
    values = {"fibre_modulus_over_modulus": 0.3, "fibre_angle": 0.0, "fibre_stiffening": 0.1}
    single, scattered = (
        np.abs(term_of(effect, {**values, **more}).forces(across, response_to(across))).max()
        for effect, more in ((TENSION_ONLY, {}), (DISPERSED, {"dispersion": 0.25}))
    )
    assert single == 0.0
    assert scattered > 0.0


def test_fibres_at_an_angle_pull_the_gripper_sideways() -> None:
    _, state, _ = driven(
        pulled_to(5.0),
        (term_of(BOTH_WAYS, {"fibre_modulus_over_modulus": 0.2, "fibre_angle": np.pi / 4}),),
    )
    sideways, along = state.forces[PROBLEM.gripped].sum(axis=0)[[1, 0]]
    assert abs(sideways) > 0.02 * along


# At small strain the force follows the modulus: exactly where all of it relaxes, and nearly where the volume is kept,
# which an element does in the mean only.
@pytest.mark.parametrize(
    ("part", "poisson_ratio", "tolerance"), [("whole", 0.4, 1e-4), ("isochoric", 0.4999, 2e-3)]
)
def test_held_tissue_relaxes_as_the_hereditary_integral_says(
    part: RelaxingPart, poisson_ratio: float, tolerance: float
) -> None:
    # A ramp over T = 2 s, then 1 + Σ g τ/T (1 − exp(−T/τ)) exp(−t/τ) times the long-term force.
    tissue = make_material(TISSUE.law, 1e4, poisson_ratio)
    held_s = [1.0, 4.0, 15.0, 60.0]
    poses = pulled_to(0.025, 0.05, 0.075, *[0.1] * 5)
    seconds = [0.5] * 4 + list(np.diff([0.0, *held_s]))
    term = term_of(Viscoelasticity("", 2, part), TWO_TIMES, tissue)
    pulls, _, _ = driven(poses, (term,), seconds, material=tissue)
    relaxed, _, _ = driven(pulled_to(0.1), material=tissue)
    expected = [
        1 + sum(g * tau / 2 * -np.expm1(-2 / tau) * np.exp(-t / tau) for g, tau in ((0.2, 3.0), (0.3, 30.0)))
        for t in held_s
    ]
    np.testing.assert_allclose(pulls[4:] / relaxed[0], expected, rtol=tolerance)


def test_the_stress_of_an_energy_has_the_forces_of_that_energy() -> None:
    response = response_to(smooth_field(0.2), EXPONENTIAL)
    expected = nodal_forces(PROBLEM.body, response, response.slope)
    found = forces_of_stress(PROBLEM.body, stress_of(response.F, response.slope))
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_what_relaxes_bears_no_pressure() -> None:
    field = smooth_field(0.2)
    response = response_to(field)
    stress = second_piola(response.F, isochoric_energy(TISSUE, response).slope)
    c = np.swapaxes(response.F, -1, -2) @ response.F
    # the Kirchhoff stress F S Fᵀ has the trace S : C
    assert np.abs(np.sum(stress * c, axis=(-2, -1))).max() < 1e-9 * np.abs(stress).max()


def test_long_held_tissue_bears_the_long_term_force_whatever_the_stretch() -> None:
    pulls, _, _ = driven(pulled_to(*[10.0] * 4), (term_of(ONE_TERM, ONE_TIME),), [1.0, 100.0, 100.0, 100.0])
    relaxed, _, _ = driven(pulled_to(10.0))
    assert pulls[0] > 1.3 * relaxed[0]
    assert pulls[-1] == pytest.approx(relaxed[0], rel=1e-6)


def test_tissue_that_relaxed_in_a_hold_bears_less_than_the_long_term_force_on_the_way_back() -> None:
    seconds = [2.0, 2.0, 30.0, 2.0]
    pulls, _, terms = driven(pulled_to(4.0, 8.0, 8.0, 4.0), (term_of(WHOLE, ONE_TIME),), seconds)
    relaxed, _, _ = driven(pulled_to(4.0))
    assert pulls[3] < relaxed[0] < pulls[0]
    again, _, _ = driven(pulled_to(4.0), tuple(term.rested() for term in terms), [2.0])
    assert again[0] == pytest.approx(pulls[0], rel=1e-8)


def test_two_relaxation_times_are_sought_in_one_order_only() -> None:
    starts = TWO_TERMS.starts([])
    assert len(starts) == 6
    assert all(start["relaxation_time_1"] < start["relaxation_time_2"] for start in starts)


@pytest.mark.parametrize(("effect", "values"), WIDTHS, ids=["absolute", "relative", "both"])
def test_tissue_is_softer_below_its_largest_strain_and_virgin_beyond(
    effect: Effect, values: dict[str, float]
) -> None:
    first, _, terms = driven(pulled_to(4.0, 8.0, 4.0), (term_of(effect, values),))
    second, _, _ = driven(pulled_to(4.0, 8.0, 10.0), tuple(term.rested() for term in terms))
    virgin, _, _ = driven(pulled_to(4.0, 8.0, 10.0))
    np.testing.assert_allclose(first[:2], virgin[:2], rtol=1e-6)
    assert 0.7 * virgin[0] < first[2] < 0.9 * virgin[0]
    assert second[0] == pytest.approx(first[2], rel=1e-6)
    np.testing.assert_allclose(second[1:], virgin[1:], rtol=1e-6)


def test_the_depth_of_softening_is_that_of_ogden_and_roxburgh() -> None:
    past, rest = smooth_field(0.2), 1e-4 * smooth_field(1.0)
    term = term_of(PSEUDO_ELASTIC, {"depth": 0.3, "width_over_modulus": 1e-6, "relative_width": 0.1}).after(
        past, response_to(past)
    )
    shear = make_material(TISSUE.law, 2 * TISSUE.lame[0], 0.0)
    own = response_to(rest, shear)
    virgin = term_of(WHOLE, {"relaxing_share_1": 1.0, "relaxation_time_1": 1.0}, shear).starting_after(0.0)
    np.testing.assert_allclose(
        term.forces(rest, response_to(rest)), -0.3 * virgin.forces(rest, own), rtol=1e-6, atol=1e-13
    )


def test_damaged_tissue_is_a_softer_one_below_the_largest_strain() -> None:
    depth = 0.3
    past, later = smooth_field(0.2), smooth_field(0.1)
    term = term_of(DAMAGE, {"depth": depth, "width_over_modulus": 1e-4, "order": 1.0}).after(
        past, response_to(past)
    )
    # The width is so small that all of it is lost wherever there was strain: what is left is (1 − d) of the stress.
    whole = term_of(DAMAGE, {"depth": 1.0, "width_over_modulus": 1e-9, "order": 1.0}).after(
        past, response_to(past)
    )
    lost, all_there_is = (one.forces(later, response_to(later)) for one in (term, whole))
    scale = np.abs(all_there_is).max()
    np.testing.assert_allclose(lost, depth * all_there_is, rtol=0.0, atol=0.02 * scale)


def test_tissue_damaged_evenly_as_a_whole_has_a_smaller_modulus_and_the_same_poisson_ratio() -> None:
    # The width is so small that everywhere all is lost that can be.
    damaged = (term_of(DAMAGE_WHOLE, LOST_AT_ONCE),)
    pulls, state, _ = driven(pulled_to(4.0, 8.0), damaged)
    virgin, at_virgin, _ = driven(pulled_to(4.0, 8.0))
    np.testing.assert_allclose(pulls, 0.7 * np.array(virgin), rtol=1e-5)
    np.testing.assert_allclose(state.displacement, at_virgin.displacement, rtol=0.0, atol=1e-8)


def test_damage_bends_the_virgin_curve_and_the_way_back_is_straighter() -> None:
    values = {"depth": 0.4, "width_over_modulus": 0.01, "order": 1.0}
    pulls, _, _ = driven(pulled_to(5.0, 10.0, 5.0), (term_of(DAMAGE, values),))
    virgin, _, _ = driven(pulled_to(5.0, 10.0))
    shares = np.array(pulls) / np.array([*virgin, virgin[0]])
    assert shares[1] < shares[0] < 1.0
    assert shares[2] < shares[0]


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
def test_damage_of_any_order_takes_the_same_share_once_the_energy_reaches_its_width(order: float) -> None:
    width = 0.02
    law = ContinuumDamage(0.4, width, order)
    energies = np.array([[0.25 * width, width, 4.0 * width]])
    lost, _ = law.lost(energies, np.zeros_like(energies))
    expected = 0.4 * (1 - np.exp(-(np.array([0.25, 1.0, 4.0]) ** order)))
    np.testing.assert_allclose(lost[0], expected, rtol=1e-12)
    # It stays where the energy has fallen again.
    later, by_energy = law.lost(np.zeros_like(energies), energies)
    np.testing.assert_allclose(later, lost, rtol=1e-12)
    assert not by_energy.any()


def test_a_set_shows_after_unloading_and_stays() -> None:
    pulls, state, terms = driven(pulled_to(5.0, 10.0, 5.0, 0.0), (term_of(PERMANENT_SET, {"share": 0.1}),))
    virgin, _, _ = driven(pulled_to(5.0, 10.0))
    np.testing.assert_allclose(pulls[:2], virgin, rtol=1e-6)
    assert pulls[2] < virgin[0]
    assert -0.3 * virgin[1] < pulls[3] < 0.0
    assert np.abs(state.displacement).max() > 1e-5
    later, _, _ = driven(pulled_to(0.0), tuple(term.rested() for term in terms))
    assert later[0] == pytest.approx(pulls[3], rel=1e-6)


def test_free_tissue_comes_to_rest_at_the_share_of_the_largest_strain() -> None:
    # At a small isochoric strain the tissue's own stress at c·ε cancels that of the set, but for the share of W/Wm.
    points, share = PROBLEM.body.mesh.points, 0.05
    largest = points * np.array([2e-4, -1e-4, -1e-4])
    term = term_of(PERMANENT_SET, {"share": share}).after(largest, response_to(largest))
    left = share * largest
    own = term_of(ONE_TERM, {"relaxing_share_1": 1.0, "relaxation_time_1": 1.0}).starting_after(0.0)
    balance = own.forces(left, response_to(left)) + term.forces(left, response_to(left))
    scale = np.abs(own.forces(left, response_to(left))).max()
    assert np.abs(balance).max() < 2 * share**2 * scale
