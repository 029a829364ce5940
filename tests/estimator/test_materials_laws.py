"""The laws against the textbook formulas, against difference quotients, and against each other."""

from collections.abc import Callable

import numpy as np
import pytest

from estimator.errors import InputError, SolverError
from estimator.materials import (
    LAWS,
    Gent,
    IsochoricMooneyRivlin,
    Knowles,
    MooneyRivlin,
    NeoHookean,
    VerondaWestmann,
    law_named,
)
from estimator.materials.law import EnergyDerivatives, FloatArray, Law

TYPICAL_SHAPE = {
    "neo_hookean": [],
    "mooney_rivlin": [0.3],
    "isochoric_mooney_rivlin": [0.3],
    "yeoh2": [0.2],
    "yeoh3": [-0.1, 0.05],
    "gent": [0.3],
    "knowles": [0.8, -0.5],
    "arruda_boyce": [0.25],
    "veronda_westmann": [0.8, -0.4],
    "ogden1": [3.0],
    "ogden2": [2.5, -1.5, 0.3],
    "st_venant_kirchhoff": [],
}
EVERY_LAW = (*LAWS.values(), IsochoricMooneyRivlin(), Knowles())
ALL_LAWS = pytest.mark.parametrize("law", EVERY_LAW, ids=lambda law: law.name)
# All but St. Venant's and Kirchhoff's contain the Neo-Hookean law.
DEPARTURES = [law for law in EVERY_LAW if law.name != "st_venant_kirchhoff"]


def typical_shape(law: Law) -> FloatArray:
    return np.array(TYPICAL_SHAPE[law.name], dtype=float)


def null_shape(law: Law) -> FloatArray:
    return np.array([parameter.null for parameter in law.shape_parameters])


def invariants(F: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    C = np.swapaxes(F, -1, -2) @ F
    i1 = np.trace(C, axis1=-2, axis2=-1)
    i2 = 0.5 * (i1**2 - np.trace(C @ C, axis1=-2, axis2=-1))
    return i1, i2, np.linalg.det(F)


def deformations(count: int, size: float) -> FloatArray:
    """Random deformation gradients about the identity, with shear and volume change."""
    return np.eye(3) + size * np.random.default_rng(7).uniform(-1, 1, (count, 3, 3))


def slope(function: Callable[[float], FloatArray], at: FloatArray | float, step: float = 2e-3) -> FloatArray:
    """Sixth-order central difference quotient."""
    pairs = zip((45, -9, 1), (1, 2, 3), strict=True)
    return sum(c * (function(at + k * step) - function(at - k * step)) for c, k in pairs) / (60 * step)


def eight_chain_series(i1: FloatArray, a: float) -> FloatArray:
    """Energy over small-strain shear modulus as finite element manuals print both, a = 1/λm²."""
    modulus = 1 + 3 / 5 * a + 99 / 175 * a**2 + 513 / 875 * a**3 + 42039 / 67375 * a**4
    series = (i1 - 3) / 2 + a / 20 * (i1**2 - 9) + 11 * a**2 / 1050 * (i1**3 - 27)
    series += 19 * a**3 / 7000 * (i1**4 - 81) + 519 * a**4 / 673750 * (i1**5 - 243)
    return series / modulus


@ALL_LAWS
def test_derivatives_by_the_invariants_agree_with_difference_quotients(law: Law) -> None:
    shape = typical_shape(law)
    point = list(invariants(deformations(20, 0.25)))
    exact = law.derivatives(*point, shape)
    pairs = {(0, 0): 0, (0, 1): 1, (0, 2): 2, (1, 1): 3, (1, 2): 4, (2, 2): 5}
    for k in range(3):

        def along(value: FloatArray, k: int = k) -> EnergyDerivatives:
            return law.derivatives(*point[:k], value, *point[k + 1 :], shape)

        np.testing.assert_allclose(
            exact.first[k], slope(lambda v: along(v).value, point[k]), rtol=1e-9, atol=1e-10
        )
        numeric = slope(lambda v: along(v).first, point[k])
        for other in range(3):
            row = pairs[min(k, other), max(k, other)]
            np.testing.assert_allclose(exact.second[row], numeric[other], rtol=1e-8, atol=1e-9)


@ALL_LAWS
def test_derivatives_by_the_shape_agree_with_difference_quotients(law: Law) -> None:
    shape = typical_shape(law)
    point = invariants(deformations(20, 0.25))
    exact = law.derivatives(*point, shape).first_by_shape
    assert exact.shape == (len(shape), 3, 20)
    for n in range(len(shape)):

        def along(value: float, n: int = n) -> FloatArray:
            changed = shape.copy()
            changed[n] = value
            return law.derivatives(*point, changed).first

        np.testing.assert_allclose(exact[n], slope(along, float(shape[n])), rtol=1e-8, atol=1e-9)


@ALL_LAWS
def test_derivatives_by_the_shape_are_exact_at_the_null_too(law: Law) -> None:
    """Screening starts at the null, where some closed forms are 0/0."""
    null = null_shape(law)
    point = invariants(deformations(20, 0.25))
    exact = law.derivatives(*point, null).first_by_shape
    step = 1e-6
    for n in range(len(null)):
        ahead, further = null.copy(), null.copy()
        ahead[n] += step
        further[n] += 2 * step
        first = [law.derivatives(*point, s).first for s in (null, ahead, further)]
        one_sided = (-3 * first[0] + 4 * first[1] - first[2]) / (2 * step)
        np.testing.assert_allclose(exact[n], one_sided, rtol=1e-6, atol=1e-8)


@ALL_LAWS
@pytest.mark.parametrize("shape_of", [typical_shape, null_shape])
def test_small_strain_energy_is_strain_contracted_with_itself(
    law: Law, shape_of: Callable[[Law], FloatArray]
) -> None:
    size = 1e-4
    F = deformations(20, size)
    strain = 0.5 * (F + np.swapaxes(F, 1, 2)) - np.eye(3)
    expected = np.einsum("nij,nij->n", strain, strain)
    # x and y are differences of numbers near 3, hence the absolute tolerance of some machine epsilons
    np.testing.assert_allclose(
        law.derivatives(*invariants(F), shape_of(law)).value, expected, rtol=30 * size, atol=2e-15
    )


@ALL_LAWS
def test_the_reference_state_is_free_of_stress_and_energy(law: Law) -> None:
    energy = law.derivatives(np.array([3.0]), np.array([3.0]), np.array([1.0]), typical_shape(law))
    assert energy.value[0] == pytest.approx(0.0, abs=1e-15)
    # dW/dF at F = 1 is a multiple of the identity: 2 W1 + 4 W2 + WJ
    assert np.array([2.0, 4.0, 1.0]) @ energy.first[:, 0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("law", DEPARTURES, ids=lambda law: law.name)
def test_the_null_value_gives_the_neo_hookean_law_to_rounding(law: Law) -> None:
    """A law in principal stretches sums some dozens of complex numbers of order one."""
    point = invariants(deformations(20, 0.4))
    found = law.derivatives(*point, null_shape(law))
    baseline = NeoHookean().derivatives(*point, np.empty(0))
    rounding = 1e-13 if law.name.startswith("ogden") else 1e-15
    np.testing.assert_allclose(found.value, baseline.value, rtol=1e-14, atol=rounding)
    np.testing.assert_allclose(found.first, baseline.first, rtol=1e-15, atol=rounding)
    np.testing.assert_allclose(found.second, baseline.second, rtol=1e-15, atol=rounding)


def test_neo_hookean_is_the_equation_4_of_the_paper() -> None:
    mu, lame = 5.0e3, 2.0e4
    i1, i2, j = invariants(deformations(50, 0.3))
    i3 = j**2
    paper = 0.5 * (mu * (i1 - 3) - mu * np.log(i3) + lame * (np.sqrt(i3) - 1) ** 2)
    ours = mu * NeoHookean().derivatives(i1, i2, j, np.empty(0)).value + lame / 2 * (j - 1) ** 2
    np.testing.assert_allclose(ours, paper, rtol=1e-13, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "shape", "classical"),
    [
        ("mooney_rivlin", [0.25], lambda a, b: 0.375 * a + 0.125 * b),
        ("yeoh3", [0.2, 0.04], lambda a, b: 0.5 * a + 0.1 * a**2 + 0.02 * a**3),
        ("gent", [0.25], lambda a, b: -(4 / 2) * np.log(1 - a / 4)),
        ("arruda_boyce", [0.4], lambda a, b: eight_chain_series(a + 3, 0.4)),
        ("veronda_westmann", [0.8, -1.0], lambda a, b: 1 / 0.8 * (np.exp(0.8 * a) - 1) - b / 2),
        ("ogden2", [2.0, -2.0, 0.25], lambda a, b: 0.375 * a + 0.125 * b),
    ],
)
def test_laws_are_the_classical_ones_without_volume_change(
    name: str, shape: list[float], classical: Callable[[FloatArray, FloatArray], FloatArray]
) -> None:
    F = deformations(30, 0.3)
    i1, i2, j = invariants(F / np.cbrt(np.linalg.det(F))[:, None, None])
    energy = LAWS[name].derivatives(i1, i2, j, np.array(shape)).value
    np.testing.assert_allclose(energy, classical(i1 - 3, i2 - 3), rtol=1e-12, atol=1e-14)


def test_the_isochoric_mooney_rivlin_law_does_not_feel_a_change_of_volume() -> None:
    F, shape = deformations(30, 0.3), np.array([0.4])
    law, plain = IsochoricMooneyRivlin(), NeoHookean()

    def departure(F: FloatArray) -> FloatArray:
        point = invariants(F)
        return law.derivatives(*point, shape).value - plain.derivatives(*point, np.empty(0)).value

    np.testing.assert_allclose(departure(1.2 * F), departure(F), rtol=1e-10, atol=1e-14)
    isochoric = F / np.cbrt(np.linalg.det(F))[:, None, None]
    modified = MooneyRivlin().derivatives(*invariants(isochoric), shape).value
    np.testing.assert_allclose(law.derivatives(*invariants(isochoric), shape).value, modified, rtol=1e-12)


def test_arruda_boyce_follows_the_inverse_langevin_function() -> None:
    """Its stress goes as L⁻¹(λ/λm)/λ, λ² = I1/3; the series holds to 0.2 % up to half the locking stretch."""

    def inverse_langevin(y: FloatArray) -> FloatArray:
        beta = 3 * y
        for _ in range(50):
            beta = beta - (1 / np.tanh(beta) - 1 / beta - y) / (1 / beta**2 - 1 / np.sinh(beta) ** 2)
        return beta

    locking = 4.0
    i1 = np.linspace(3.0, 3 * (0.5 * locking) ** 2, 20)
    one = np.ones_like(i1)
    found = LAWS["arruda_boyce"].derivatives(i1, 3 * one, one, np.array([1 / locking**2])).first[0]
    stretch = np.sqrt(i1 / 3)
    chains = inverse_langevin(stretch / locking) / stretch
    np.testing.assert_allclose(found / found[0], chains / chains[0], rtol=2e-3)


def test_gent_refuses_what_lies_beyond_its_limit() -> None:
    one = np.ones(2)
    with pytest.raises(SolverError, match=r"limit of the Gent law.*1/Jm = 0\.5"):
        Gent().derivatives(np.array([4.0, 5.0]), 3 * one, one, np.array([0.5]))


def test_veronda_westmann_refuses_an_energy_that_overflows() -> None:
    one = np.ones(1)
    with pytest.raises(SolverError, match="overflows"):
        VerondaWestmann().derivatives(40 * one, 3 * one, one, np.array([20.0, 0.0]))


@pytest.mark.parametrize("j", [0.0, -0.5, np.nan])
def test_every_law_refuses_material_turned_inside_out(j: float) -> None:
    for law in EVERY_LAW:
        with pytest.raises(SolverError, match="inside out"):
            law.derivatives(np.array([3.0]), np.array([3.0]), np.array([j]), null_shape(law))


def test_laws_are_found_by_name_and_an_unknown_name_lists_them() -> None:
    assert isinstance(law_named("mooney_rivlin"), MooneyRivlin)
    with pytest.raises(InputError, match=r"no law is called 'hook'.*neo_hookean.*gent"):
        law_named("hook")


@ALL_LAWS
def test_null_values_lie_within_the_bounds(law: Law) -> None:
    for parameter in law.shape_parameters:
        assert parameter.lower <= parameter.null <= parameter.upper
        assert parameter.scale > 0


def ogden_by_eigenvalues(F: FloatArray, exponent: float) -> FloatArray:
    """2/α² (Σ λᵢ^α − 3 − α ln J), as the formula has it."""
    stretches = np.linalg.svd(F, compute_uv=False)
    powers = np.sum(stretches**exponent, axis=-1) - 3 - exponent * np.log(np.linalg.det(F))
    return 2 / exponent**2 * powers


@pytest.mark.parametrize("exponent", [-7.0, -0.5, 1.3, 4.0, 12.0])
def test_ogdens_law_is_a_power_of_the_principal_stretches(exponent: float) -> None:
    F = deformations(40, 0.4)
    found = LAWS["ogden1"].derivatives(*invariants(F), np.array([exponent])).value
    np.testing.assert_allclose(found, ogden_by_eigenvalues(F, exponent), rtol=1e-12, atol=1e-14)


def test_ogdens_law_without_an_exponent_is_henckys() -> None:
    F = deformations(40, 0.4)
    hencky = np.sum(np.log(np.linalg.svd(F, compute_uv=False)) ** 2, axis=-1)
    for exponent in (0.0, 1e-9):
        found = LAWS["ogden1"].derivatives(*invariants(F), np.array([exponent])).value
        np.testing.assert_allclose(found, hencky, rtol=1e-7, atol=1e-14)


@pytest.mark.parametrize(
    "stretches",
    [
        (1.4, 1.4, 1.4),
        (1.4, 1.4, 0.6),
        (0.7, 1.6, 1.6),
        (1.4, 1.4 + 1e-9, 0.6),
        (1.0, 1.0, 1.0),
        (0.05, 1.0, 4.0),
    ],
)
@pytest.mark.parametrize("exponent", [-3.0, 1.3, 6.0])
def test_principal_stretches_may_coincide(stretches: tuple[float, float, float], exponent: float) -> None:
    """dw/dλ along each axis, by the chain rule over the invariants and by hand; and again for the tangent."""
    shape = np.array([exponent])

    def invariants_of(s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        a = s**2
        return (
            np.array([a.sum()]),
            np.array([a[0] * a[1] + a[1] * a[2] + a[2] * a[0]]),
            np.array([s.prod()]),
        )

    s = np.array(stretches)
    found = LAWS["ogden1"].derivatives(*invariants_of(s), shape)
    a, j = s**2, s.prod()
    by_stretch = np.stack([2 * s, 2 * s * (a.sum() - a), j / s])  # of I1, I2 and J, (3 invariants, 3 axes)
    slopes = found.first[:, 0] @ by_stretch
    np.testing.assert_allclose(
        slopes,
        2 / exponent * (s ** (exponent - 1) - 1 / s),
        rtol=1e-9,
        atol=1e-9 * np.abs(slopes).max() + 1e-13,
    )
    rows = [[0, 1, 2], [1, 3, 4], [2, 4, 5]]
    curvature = by_stretch.T @ found.second[rows, 0] @ by_stretch
    second_of_i1 = 2 * np.eye(3)
    second_of_i2 = 4 * np.outer(s, s) - np.diag(4 * a) + np.diag(2 * (a.sum() - a))
    second_of_j = j / np.outer(s, s) - np.diag(j / a)
    for first, second in zip(found.first[:, 0], (second_of_i1, second_of_i2, second_of_j), strict=True):
        curvature += first * second
    exact = np.diag(2 / exponent * ((exponent - 1) * s ** (exponent - 2) + 1 / a))
    np.testing.assert_allclose(curvature, exact, atol=1e-8 * np.abs(exact).max())


def test_st_venants_and_kirchhoffs_law_is_linear_between_strain_and_second_stress() -> None:
    """S = 2 ∂W/∂C = 2 μ E + λ tr E, with ∂I1/∂C = 1, ∂I2/∂C = I1 − C."""
    mu, lame = 3.0, 7.0
    F = deformations(20, 0.3)
    i1, i2, j = invariants(F)
    law = LAWS["st_venant_kirchhoff"].derivatives(i1, i2, j, np.empty(0))
    by = law.dilatation_by
    dilatation = by[0] * (i1 - 3) + by[1] * (i2 - 3) + by[2] * (j - 1)
    first = mu * law.first + np.multiply.outer(by, lame * dilatation)
    C, identity = np.swapaxes(F, 1, 2) @ F, np.eye(3)
    strain = (C - identity) / 2
    stress = 2 * first[0][:, None, None] * identity
    stress = stress + 2 * first[1][:, None, None] * (i1[:, None, None] * identity - C)
    expected = 2 * mu * strain + lame * np.trace(strain, axis1=1, axis2=2)[:, None, None] * identity
    np.testing.assert_allclose(stress, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("course", "law", "shape"),
    [
        (1.0, law_named("yeoh2"), [0.4]),
        (0.0, law_named("veronda_westmann"), [0.8, 0.0]),
        (-1.0, law_named("gent"), [0.8]),
    ],
    ids=["yeoh", "fung", "gent"],
)
@pytest.mark.parametrize("beside", [0.0, 1e-8, 1e-4])
def test_the_law_of_knowles_goes_over_into_those_of_others(
    course: float, law: Law, shape: list[float], beside: float
) -> None:
    point = invariants(deformations(20, 0.2))
    found = Knowles().derivatives(*point, np.array([0.8, course + beside]))
    expected = law.derivatives(*point, np.array(shape))
    for part in ("value", "first", "second"):
        scale = np.abs(getattr(expected, part)).max()
        np.testing.assert_allclose(
            getattr(found, part), getattr(expected, part), atol=(1e-8 + beside) * scale
        )


def test_beyond_its_limit_the_law_of_knowles_has_no_energy() -> None:
    with pytest.raises(SolverError, match="limit"):
        Knowles().derivatives(*invariants(deformations(5, 0.5)), np.array([9.0, -3.0]))
