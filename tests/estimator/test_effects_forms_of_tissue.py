"""Forms between others: a continuous number leads from one to the next."""

import numpy as np
import pytest
from retraction_cases import REFERENCE_BLOCK
from tissue_effects import PROBLEM, TISSUE, driven, pulled_to, response_to, smooth_field

from estimator.effects.effect import Effect, Values
from estimator.effects.mounting.support_friction import SUPPORT_FRICTION
from estimator.effects.tissue.anisotropy import ANISOTROPY
from estimator.effects.tissue.inhomogeneity import INHOMOGENEITY
from estimator.fem.discretisation.quadrature import quadrature_points
from estimator.fem.terms.film import ViscousFilm
from estimator.fem.terms.friction import LaidDownAnew

DRY = SUPPORT_FRICTION[0]
VISCOUS = next(one for one in SUPPORT_FRICTION if one.form == "viscous")
TABLE = {"coefficient": 0.5, "contact": 0.0, "adhesion": 40.0, "elastic_slip": 2e-4}
REGION = {"log_stiffness_ratio": 0.7, "centre_x": -0.02, "centre_y": 0.01, "radius": 0.014}


def form(effects: tuple[Effect, ...], name: str) -> Effect:
    return next(one for one in effects if one.form == name)


def field_of(name: str, **values: float) -> np.ndarray:
    found = form(INHOMOGENEITY, name).log_modulus(PROBLEM, {**REGION, **values})
    assert found is not None
    return found


def test_a_round_region_with_a_narrow_rim_is_a_cylinder() -> None:
    narrow = field_of("graded", rim=1e-3, elongation_x=0.0, elongation_diagonal=0.0)
    np.testing.assert_allclose(narrow, field_of("cylinder"), atol=1e-12)


@pytest.mark.parametrize(("x", "diagonal", "degrees"), [(0.8, 0.0, 0.0), (0.0, 0.8, 45.0), (-0.8, 0.0, 90.0)])
def test_an_oblong_region_lies_along_the_axis_that_its_elongations_say(
    x: float, diagonal: float, degrees: float
) -> None:
    field = field_of("graded", rim=2e-3, elongation_x=x, elongation_diagonal=diagonal)
    arms = quadrature_points(PROBLEM.body.mesh)[..., :2] - [REGION["centre_x"], REGION["centre_y"]]
    weight = field * PROBLEM.body.volume
    spread = np.einsum("eq,eqi,eqj->ij", weight, arms, arms) / weight.sum()
    lengths, axes = np.linalg.eigh(spread)
    angle = np.degrees(np.arctan2(axes[1, 1], axes[0, 1])) % 180.0
    assert min(abs(angle - degrees), 180.0 - abs(angle - degrees)) < 10.0
    assert np.sqrt(lengths[1] / lengths[0]) == pytest.approx(np.exp(0.8), rel=0.2)


def test_families_that_are_hardly_apart_are_one() -> None:
    field = smooth_field(0.15)
    values = {"fibre_modulus_over_modulus": 0.3, "fibre_angle": 0.6, "fibre_stiffening": 0.8}

    def forces(name: str, **more: float) -> np.ndarray:
        terms = form(ANISOTROPY, name).terms(PROBLEM, TISSUE, REFERENCE_BLOCK, {**values, **more})
        return np.sum([term.forces(field, response_to(field)) for term in terms], axis=0)

    one = forces("tension_only")
    np.testing.assert_allclose(
        forces("two_families", half_angle_apart=1e-6), one, atol=1e-5 * np.abs(one).max()
    )
    apart = forces("two_families", half_angle_apart=0.5)
    sides = [forces("tension_only", fibre_angle=0.6 + aside) for aside in (-0.5, 0.5)]
    np.testing.assert_allclose(apart, np.mean(sides, axis=0), atol=1e-12 * np.abs(one).max())


def with_film(viscosity: float, breakaway: float = 0.0) -> Values:
    return {**TABLE, "viscosity": viscosity, "breakaway": breakaway}


def test_a_film_drags_by_the_speed_and_lets_go_where_the_tissue_stands() -> None:
    film = ViscousFilm.at_rest(np.full(len(PROBLEM.body.mesh.points), 3.0))
    moved = smooth_field(0.05)
    there = film.starting_after(2.0)
    response = response_to(moved)
    np.testing.assert_allclose(there.forces(moved, response)[:, :2], 3.0 * moved[:, :2] / 2.0)
    assert not there.forces(moved, response)[:, 2].any()
    stands = there.after(moved, response).starting_after(2.0)
    assert not stands.forces(moved, response).any()
    assert not film.starting_after(0.0).forces(moved, response).any()


def test_a_viscous_table_holds_a_quick_pull_up_and_a_slow_one_as_a_dry_one_does() -> None:
    poses = pulled_to(2.0, 4.0)

    def pull(effect: Effect, values: Values, seconds: float) -> float:
        pulls, _, _ = driven(poses, effect.terms(PROBLEM, TISSUE, REFERENCE_BLOCK, values), [seconds] * 2)
        return float(pulls[-1])

    dry = pull(DRY, TABLE, 1.0)
    assert pull(VISCOUS, with_film(5e4), 1.0) > 1.02 * dry
    assert pull(VISCOUS, with_film(5e4), 1e5) == pytest.approx(dry, rel=1e-3)
    assert pull(VISCOUS, with_film(0.0), 1.0) == pytest.approx(dry, rel=1e-9)


def test_what_sticks_more_before_it_slides_holds_no_more_once_it_has_slid_far() -> None:
    area = np.array([1.0])
    lying = LaidDownAnew.at_rest(area, 0.0 * area, 0.5, 1e-4, np.inf, breakaway=1.0)
    response = response_to(smooth_field(0.0))

    def force_at(term: LaidDownAnew, way_m: float) -> float:
        return float(term.forces(np.array([[way_m, 0.0, 0.0]]), response)[0, 0])

    assert force_at(lying, 1e-4) == pytest.approx(2 * 0.5)
    far = lying.after(np.array([[3e-3, 0.0, 0.0]]), response)
    assert force_at(far, 3.1e-3) == pytest.approx(0.5, rel=1e-6)
    assert force_at(far.rested(), 1e-4) == pytest.approx(2 * 0.5)
