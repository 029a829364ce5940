"""Effects of the tissue that change its law or the field of its modulus."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from retraction_cases import REFERENCE_BLOCK
from scipy.spatial.transform import Rotation
from tissue_effects import PROBLEM, TISSUE, driven, pulled_to

from estimator.effects.effect import Effect, Readings
from estimator.effects.tissue.inhomogeneity import INHOMOGENEITY, Inhomogeneity
from estimator.effects.tissue.modulus_gradient import MODULUS_GRADIENT
from estimator.effects.tissue.second_invariant import SECOND_INVARIANT
from estimator.effects.tissue.strain_stiffening import STRAIN_STIFFENING, StrainStiffening
from estimator.fem.assembly.body import with_modulus
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.quadrature import quadrature_points
from estimator.materials import NeoHookean

LAWS = (*STRAIN_STIFFENING, *SECOND_INVARIANT)
FIELDS = (*INHOMOGENEITY, *MODULUS_GRADIENT)
CYLINDER, SPHERE, *_ = INHOMOGENEITY


def name_of(effect: Effect) -> str:
    return effect.name


def at_null(effect: Effect) -> dict[str, float]:
    constants = {constant.name: constant.grid[0] for constant in effect.constants}
    return {**constants, **{amplitude.name: 0.0 for amplitude in effect.amplitudes}}


def inclusion(log_ratio: float, x: float = -0.02, y: float = 0.01, radius: float = 0.012) -> dict[str, float]:
    return {"log_stiffness_ratio": log_ratio, "centre_x": x, "centre_y": y, "radius": radius}


def nominal_stress(effect: Effect, share_of_scale: float, stretch: float) -> float:
    """Uniaxial stress over μ of an incompressible tissue."""
    amplitude = effect.amplitudes[0]
    values = {**at_null(effect), amplitude.name: share_of_scale * amplitude.scale}
    law = effect.material(TISSUE, values)
    i1, i2 = stretch**2 + 2 / stretch, 2 * stretch + 1 / stretch**2
    first = law.law.derivatives(np.array([i1]), np.array([i2]), np.ones(1), law.shape).first[:, 0]
    return float(2 * (stretch - 1 / stretch**2) * (first[0] + first[1] / stretch))


def with_field(effect: Effect, values: dict[str, float]) -> RetractionProblem:
    field = effect.log_modulus(PROBLEM, values)
    assert field is not None
    return replace(PROBLEM, body=with_modulus(PROBLEM.body, np.exp(field)))


@pytest.mark.parametrize("effect", LAWS, ids=name_of)
def test_a_law_at_its_null_is_the_material_itself(effect: Effect) -> None:
    assert effect.material(TISSUE, at_null(effect)) is TISSUE


@pytest.mark.parametrize("effect", FIELDS, ids=name_of)
def test_a_field_at_its_null_is_absent(effect: Effect) -> None:
    assert effect.log_modulus(PROBLEM, at_null(effect)) is None


@pytest.mark.parametrize(
    "effect", [one for one in STRAIN_STIFFENING if one.form != "arruda_boyce"], ids=name_of
)
def test_the_scale_of_stiffening_adds_a_tenth_at_a_fifth_of_stretch(effect: StrainStiffening) -> None:
    assert nominal_stress(effect, 1.0, 1.2) == pytest.approx(1.1 * nominal_stress(effect, 0.0, 1.2), rel=0.01)


@pytest.mark.parametrize("effect", STRAIN_STIFFENING, ids=name_of)
def test_stiffening_leaves_small_strains_alone(effect: StrainStiffening) -> None:
    # Ogden's stress departs in proportion to the strain, that of the others to its square.
    stretch = 1.0 + (1e-6 if effect.form.startswith("ogden") else 1e-3)
    assert nominal_stress(effect, 1.0, stretch) == pytest.approx(
        nominal_stress(effect, 0.0, stretch), rel=1e-5
    )


@pytest.mark.parametrize("effect", SECOND_INVARIANT, ids=name_of)
def test_the_second_invariant_softens_in_tension_and_not_in_small_strain(effect: Effect) -> None:
    assert nominal_stress(effect, 1.0, 1.2) < 0.97 * nominal_stress(effect, 0.0, 1.2)
    assert nominal_stress(effect, 1.0, 1.0001) == pytest.approx(nominal_stress(effect, 0.0, 1.0001), rel=1e-3)


def test_two_laws_on_one_tissue_add_their_departures() -> None:
    i1, i2, j = np.array([3.3]), np.array([3.2]), np.array([1.02])
    gent, share = {"inverse_limit": 0.8}, {"share": 0.3}
    one = STRAIN_STIFFENING[1].material(TISSUE, gent)
    other = SECOND_INVARIANT[0].material(TISSUE, share)
    both = SECOND_INVARIANT[0].material(one, share)
    found = [m.law.derivatives(i1, i2, j, m.shape) for m in (one, other, both)]
    plain = NeoHookean().derivatives(i1, i2, j, np.zeros(0))
    for part in ("value", "first", "second"):
        sum_of_departures = getattr(found[0], part) + getattr(found[1], part) - 2 * getattr(plain, part)
        np.testing.assert_allclose(
            getattr(found[2], part) - getattr(plain, part), sum_of_departures, atol=1e-14
        )
    assert [p.name for p in both.law.shape_parameters] == [
        "gent.inverse_limit",
        "mooney_rivlin.second_invariant_share",
    ]
    assert found[2].first_by_shape.shape == (2, 3, 1)


@pytest.mark.parametrize("log_ratio", [1.0, -1.0])
def test_a_stiff_region_raises_the_force_and_a_soft_one_lowers_it(log_ratio: float) -> None:
    plain, _, _ = driven(pulled_to(5.0))
    changed, _, _ = driven(pulled_to(5.0), problem=with_field(CYLINDER, inclusion(log_ratio)))
    assert np.sign(changed[0] - plain[0]) == np.sign(log_ratio)
    assert abs(changed[0] / plain[0] - 1) < 0.3


def test_the_region_lies_where_it_is_said_to() -> None:
    field = CYLINDER.log_modulus(PROBLEM, inclusion(0.7))
    assert field is not None
    distance = np.linalg.norm(quadrature_points(PROBLEM.body.mesh)[..., :2] - [-0.02, 0.01], axis=-1)
    assert field[distance < 0.006] == pytest.approx(0.7, rel=0.05)
    assert np.abs(field[distance > 0.022]).max() < 0.01


@pytest.mark.parametrize("radius", [0.007, 0.011, 0.015])
def test_a_region_weighs_the_same_wherever_it_ends_within_the_elements(radius: float) -> None:
    weights = []
    for x, y in itertools.product(np.linspace(-0.025, -0.01, 4), repeat=2):
        field = CYLINDER.log_modulus(PROBLEM, inclusion(1.0, x, y, radius))
        assert field is not None
        weights.append(np.sum(PROBLEM.body.volume * field))
    assert np.ptp(weights) < 0.06 * np.mean(weights)


def test_a_sphere_leaves_the_surface_above_its_rim_alone() -> None:
    small = inclusion(1.0, x=0.0, y=0.0, radius=0.004)
    cylinder, sphere = CYLINDER.log_modulus(PROBLEM, small), SPHERE.log_modulus(PROBLEM, small)
    assert cylinder is not None and sphere is not None
    assert np.all(sphere <= cylinder)
    assert sphere.sum() < 0.8 * cylinder.sum()


@pytest.mark.parametrize("moved", ["centre_x", "centre_y", "radius"])
def test_the_stiffness_follows_place_and_radius_smoothly(moved: str) -> None:
    values = inclusion(1.0)

    def mean(shift: float) -> float:
        field = CYLINDER.log_modulus(PROBLEM, {**values, moved: values[moved] + shift})
        assert field is not None
        return float(
            np.sum(PROBLEM.body.volume * np.exp(field) * quadrature_points(PROBLEM.body.mesh)[..., 0])
        )

    fine, coarse = ((mean(h) - mean(-h)) / (2 * h) for h in (1e-6, 1e-4))
    assert fine == pytest.approx(coarse, rel=0.02)


def test_the_search_starts_from_places_in_the_tissue_beside_the_grasp() -> None:
    readings = Readings(
        replace(REFERENCE_BLOCK, phantom=replace(REFERENCE_BLOCK.phantom, size_m=(0.1, 0.05, 0.01))),
        REFERENCE_BLOCK.position,
        Rotation.identity(1),
        REFERENCE_BLOCK.position,
        REFERENCE_BLOCK.wrench,
        REFERENCE_BLOCK.fiducials,
        REFERENCE_BLOCK.wrench[0],
        REFERENCE_BLOCK.fiducials[0],
    )
    starts = Inhomogeneity("cylinder").starts([readings])
    places = {(start["centre_x"], start["centre_y"]) for start in starts}
    assert len(starts) == 2 * len(places)
    assert max(abs(y) for _, y in places) == pytest.approx(0.02)
    grasp = REFERENCE_BLOCK.grasp.box
    assert not any(grasp.contains((x, y, 0.0)) for x, y in places)
    assert len(places) == 25 - 3


def test_a_gradient_is_linear_in_place_and_nothing_in_the_centre() -> None:
    points = quadrature_points(PROBLEM.body.mesh)
    in_plane, through, *_ = MODULUS_GRADIENT
    field = in_plane.log_modulus(PROBLEM, {"log_modulus_by_x": 3.0, "log_modulus_by_y": -1.0})
    np.testing.assert_allclose(field, 3.0 * points[..., 0] - 1.0 * points[..., 1])
    np.testing.assert_allclose(
        through.log_modulus(PROBLEM, {"log_modulus_by_z": 20.0}), 20.0 * points[..., 2], atol=1e-15
    )


def test_a_linear_modulus_has_the_ratio_of_its_sides_and_nothing_in_the_centre() -> None:
    points = quadrature_points(PROBLEM.body.mesh)
    _, _, in_plane, through, _ = MODULUS_GRADIENT
    thickness = np.ptp(PROBLEM.body.mesh.points[:, 2])
    field = through.log_modulus(PROBLEM, {"log_modulus_by_z": np.log(3.0) / thickness})
    np.testing.assert_allclose(field, np.log(1.0 + points[..., 2] / thickness), atol=1e-14)
    small = {"log_modulus_by_x": 1e-3, "log_modulus_by_y": -2e-3}
    assert in_plane.log_modulus(PROBLEM, small) is not None
    np.testing.assert_allclose(
        in_plane.log_modulus(PROBLEM, small), MODULUS_GRADIENT[0].log_modulus(PROBLEM, small), atol=1e-8
    )


def test_integration_points_are_weighed_to_the_bodys_centre() -> None:
    body = PROBLEM.body
    first_moment = np.einsum("eq,eqx->x", body.volume, quadrature_points(body.mesh))
    gripped = 0.02 * 0.02 * 0.01
    np.testing.assert_allclose(first_moment, [-0.04 * gripped, 0.0, 0.0], atol=1e-14)
