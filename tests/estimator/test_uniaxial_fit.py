"""Laws fitted to uniaxial tests: exact on synthetic curves, honest on real ones."""

from pathlib import Path

import numpy as np
import pytest

from estimator.errors import InputError, SolverError
from estimator.materials import LAWS
from estimator.uniaxial import RankedLaw, UniaxialFit, UniaxialRecord, fit_law, fit_record, read_record
from estimator.uniaxial.stress import is_stable, uniaxial_stress

DATA = Path(__file__).parents[1] / "data" / "uniaxial"
NEO_HOOKEAN = LAWS["neo_hookean"]
SHAPES = {
    "neo_hookean": [],
    "mooney_rivlin": [0.3],
    "yeoh2": [0.1],
    "yeoh3": [-0.02, 0.01],
    "gent": [0.2],
    "arruda_boyce": [0.2],
    "veronda_westmann": [0.3, -0.4],
    "ogden1": [3.0],
    "ogden2": [2.5, -1.5, 0.3],
    "st_venant_kirchhoff": [],
}


@pytest.fixture(scope="module")
def tension() -> UniaxialRecord:
    return read_record(DATA / "ecoflex_00-30_tension.csv")


@pytest.fixture(scope="module")
def stretched(tension: UniaxialRecord) -> UniaxialFit:
    """All laws, on the record in tension."""
    return fit_record(tension)


@pytest.fixture(scope="module")
def compression() -> UniaxialRecord:
    return read_record(DATA / "ef30_0t_a1_compression.csv")


def of(fit: UniaxialFit, name: str) -> RankedLaw:
    return next(ranked for ranked in fit.ranking if ranked.fit.law.name == name)


def values(ranked: RankedLaw) -> dict[str, float]:
    return {parameter.name: parameter.value for parameter in ranked.fit.parameters}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("mode", ["tension", "compression"])
def test_the_nominal_stress_is_the_slope_of_the_energy(name: str, mode: str) -> None:
    stretch = np.linspace(1.05, 1.8, 20) if mode == "tension" else np.linspace(0.5, 0.95, 20)
    law, shape, step = LAWS[name], np.array(SHAPES[name]), 1e-4

    def energy(s: np.ndarray) -> np.ndarray:
        return law.derivatives(s**2 + 2 / s, 2 * s + s**-2, np.ones_like(s), shape).value

    slope = (8 * (energy(stretch + step) - energy(stretch - step))) / (12 * step)
    slope -= (energy(stretch + 2 * step) - energy(stretch - 2 * step)) / (12 * step)
    found = uniaxial_stress(law, 30e3, shape, stretch)
    np.testing.assert_allclose(found, 10e3 * slope, rtol=1e-8)


@pytest.mark.parametrize("name", LAWS)
def test_small_strain_stress_is_youngs_modulus_times_strain(name: str) -> None:
    strain = np.array([-1e-6, 1e-6])
    stress = uniaxial_stress(LAWS[name], 30e3, np.array(SHAPES[name]), 1 + strain)
    np.testing.assert_allclose(stress, 30e3 * strain, rtol=1e-5)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_law_recovers_its_own_parameters(name: str, sign: int) -> None:
    law, shape = LAWS[name], np.array(SHAPES[name])
    strain = sign * np.linspace(0.01, 0.7, 60)
    fit = fit_law(law, strain, uniaxial_stress(law, 30e3, shape, 1 + strain))
    assert fit.youngs_modulus.value == pytest.approx(30e3, rel=1e-5)
    np.testing.assert_allclose([p.value for p in fit.shape], shape, atol=1e-4)
    assert fit.youngs_modulus.std < 1e-4 * 30e3


@pytest.mark.parametrize("slack", [0.03, -0.03])
def test_slack_and_pre_load_are_told_apart_from_stiffening(slack: float) -> None:
    strain = np.linspace(0.05, 0.5, 40)
    stress = uniaxial_stress(NEO_HOOKEAN, 40e3, np.empty(0), 1 + strain - slack)
    held = fit_law(LAWS["yeoh2"], strain, stress)
    freed = fit_law(LAWS["yeoh2"], strain, stress, slack_limit=0.08)
    assert abs(held.youngs_modulus.value - 40e3) > 2e3
    assert freed.youngs_modulus.value == pytest.approx(40e3, rel=1e-4)
    assert freed.slack is not None
    assert freed.slack.value == pytest.approx(slack, abs=1e-5)
    assert freed.shape[0].value == pytest.approx(0.0, abs=1e-3)


def test_below_the_slack_the_specimen_bears_nothing() -> None:
    strain = np.linspace(0.05, 0.5, 40)
    stress = uniaxial_stress(NEO_HOOKEAN, 40e3, np.empty(0), 1 + strain - 0.03)
    fit = fit_law(NEO_HOOKEAN, strain, stress, slack_limit=0.08)
    np.testing.assert_array_equal(fit.stress(np.array([0.0, 0.01, 0.029])), 0.0)


def test_standard_errors_hold_where_residuals_are_correlated() -> None:
    """Correlation over a tenth of the range: the jackknife sees most of the scatter, the textbook little."""
    rng, count = np.random.default_rng(3), 200
    strain = np.linspace(0.01, 0.5, count)
    truth = uniaxial_stress(NEO_HOOKEAN, 40e3, np.empty(0), 1 + strain)
    unit = truth / 40e3
    memory = np.exp(-1 / (0.1 * count))
    estimates, jackknife, textbook = [], [], []
    for _ in range(60):
        noise = np.empty(count)
        noise[0] = rng.standard_normal()
        for i in range(1, count):
            noise[i] = memory * noise[i - 1] + np.sqrt(1 - memory**2) * rng.standard_normal()
        fit = fit_law(NEO_HOOKEAN, strain, truth + 400 * noise)
        estimates.append(fit.youngs_modulus.value)
        jackknife.append(fit.youngs_modulus.std)
        residual = fit.stress(strain) - truth - 400 * noise
        textbook.append(np.sqrt(np.sum(residual**2) / (count - 1) / (unit @ unit)))
    scatter = np.std(estimates)
    assert 0.6 < np.sqrt(np.mean(np.square(jackknife))) / scatter < 1.3
    assert np.mean(textbook) / scatter < 0.25


@pytest.mark.parametrize(("strain_fit", "modulus"), [(0.3, 43.3), (1.0, 48.4)])
def test_neo_hookean_modulus_of_ecoflex_in_tension(
    tension: UniaxialRecord, strain_fit: float, modulus: float
) -> None:
    fit = fit_record(tension, [NEO_HOOKEAN], strain_fit=strain_fit)
    assert values(fit.ranking[0])["youngs_modulus"] / 1e3 == pytest.approx(modulus, abs=0.05)


def test_fits_of_ecoflex_equal_linear_least_squares(tension: UniaxialRecord) -> None:
    """Yeoh and Mooney-Rivlin are linear in C1, C2 and C10, C01."""
    used = tension.strain <= 0.5
    stretch = 1 + tension.strain[used]
    pull = 2 * (stretch - stretch**-2)
    i1 = stretch**2 + 2 / stretch
    fit = fit_record(tension, [LAWS["yeoh2"], LAWS["mooney_rivlin"]], strain_fit=0.5)
    c1, c2 = np.linalg.lstsq(np.column_stack([pull, 2 * pull * (i1 - 3)]), tension.stress[used])[0]
    assert values(of(fit, "yeoh2")) == pytest.approx({"youngs_modulus": 6 * c1, "c2": c2 / c1}, rel=1e-6)
    c10, c01 = np.linalg.lstsq(np.column_stack([pull, pull / stretch]), tension.stress[used])[0]
    assert values(of(fit, "mooney_rivlin")) == pytest.approx(
        {"youngs_modulus": 6 * (c10 + c01), "second_invariant_share": c01 / (c10 + c01)}, rel=1e-6
    )


def test_a_better_fit_of_ecoflex_predicts_worse(stretched: UniaxialFit) -> None:
    """Yeoh's second term lowers the error up to 50 % strain and doubles the one beyond."""
    fit = stretched
    neo_hookean, yeoh = of(fit, "neo_hookean"), of(fit, "yeoh2")
    assert yeoh.rms_fit < 0.75 * neo_hookean.rms_fit
    assert yeoh.rms_test > 2 * neo_hookean.rms_test
    assert fit.closure(yeoh) == pytest.approx(1 - yeoh.rms_test / neo_hookean.rms_test)


def test_the_best_law_is_a_stable_one(stretched: UniaxialFit) -> None:
    fit = stretched
    assert [ranked.rms_test for ranked in fit.ranking] == pytest.approx(
        sorted(ranked.rms_test for ranked in fit.ranking), rel=1e-3
    )
    first = fit.ranking[0]
    assert (first.fit.law.name, first.stable) == ("mooney_rivlin", False)
    assert values(first)["second_invariant_share"] < -0.5
    assert fit.best.fit.law.name == "neo_hookean"
    assert any("Unstable in another mode" in caveat for caveat in fit.caveats)


def test_slack_explains_the_beginning_of_the_tensile_curve(tension: UniaxialRecord) -> None:
    held = of(fit_record(tension, [NEO_HOOKEAN], strain_fit=0.5), "neo_hookean")
    freed_fit = fit_record(tension, [NEO_HOOKEAN, LAWS["yeoh2"]], strain_fit=0.5, slack_limit=0.08)
    freed = of(freed_fit, "neo_hookean")
    assert freed.rms_fit < 0.6 * held.rms_fit
    assert freed.rms_test < 0.6 * held.rms_test
    assert 0.02 < values(freed)["slack"] < 0.035
    yeoh = of(freed_fit, "yeoh2")
    assert abs(values(yeoh)["c2"]) < yeoh.fit.shape[0].std


def test_compression_reads_twice_as_stiff_as_tension(
    tension: UniaxialRecord, compression: UniaxialRecord
) -> None:
    fit = fit_record(compression, [NEO_HOOKEAN])
    assert fit.strain_fit == 0.2
    modulus = values(fit.ranking[0])["youngs_modulus"]
    assert modulus / 1e3 == pytest.approx(96.5, abs=0.5)
    pulled = values(fit_record(tension, [NEO_HOOKEAN], strain_fit=0.3).ranking[0])["youngs_modulus"]
    assert 2.0 < modulus / pulled < 2.3
    assert any("factor up to 1 + 2 S² = 1.35 (S = 0.42)" in caveat for caveat in fit.caveats)


def test_a_law_that_does_not_reach_the_tested_strain_ranks_last() -> None:
    strain = np.linspace(0.05, 1.0, 40)
    stress = uniaxial_stress(LAWS["gent"], 40e3, np.array([0.6]), 1 + np.minimum(strain, 0.8))
    record = UniaxialRecord("locking", "tension", strain, stress)
    fit = fit_record(record, strain_fit=0.75, strain_test=1.0, laws=[LAWS["gent"], NEO_HOOKEAN])
    last = fit.ranking[-1]
    assert (last.fit.law.name, last.rms_test) == ("gent", float("inf"))
    with pytest.raises(SolverError):
        last.fit.stress(strain)


def test_a_parameter_that_stops_at_a_bound_says_so(compression: UniaxialRecord) -> None:
    gent = of(fit_record(compression, [LAWS["gent"], NEO_HOOKEAN]), "gent")
    assert gent.fit.shape[0].at_bound
    assert gent.fit.shape[0].value == 0.0


@pytest.mark.parametrize(
    ("name", "shape", "stable"),
    [
        ("neo_hookean", [], True),
        ("mooney_rivlin", [0.3], True),
        ("mooney_rivlin", [-0.8], False),
        ("gent", [0.3], True),
        ("yeoh2", [-0.4], False),
    ],
)
def test_stability_is_told_from_the_slope_of_the_stress(name: str, shape: list[float], stable: bool) -> None:
    assert is_stable(LAWS[name], np.array(shape), 2.0) is stable
    assert is_stable(LAWS[name], np.array(shape), 0.4) is stable


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        ({"strain_from": 0.6}, r"0\.6 to 0\.5 to 1 do not ascend"),
        ({"strain_fit": 0.5, "strain_test": 0.4}, r"do not ascend; choose others \(the record ends at 2\)"),
        ({"strain_fit": 0.15}, r"4 rows to fit \(of 10 needed\)"),
        ({"strain_fit": 2.5, "strain_test": 3.0}, r"and 0 beyond them; widen"),
        ({"slack_limit": -0.1}, r"slack limit -0\.1 is not between 0"),
    ],
)
def test_impossible_ranges_are_refused(
    tension: UniaxialRecord, ranges: dict[str, float], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        fit_record(tension, **ranges)
