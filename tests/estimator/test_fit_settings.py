"""The choices of a fit: laws, fixed parameters, priors, bounds, losses, nuisances, objectives and intervals."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from retraction_cases import COARSE_GRADING, SMALL_BLOCK, follow, recorded, straight_pull, turning_pull

from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fit import estimate as whole
from estimator.fit.losses import LOSSES, Loss, loss_named
from estimator.fit.nuisances import USUAL
from estimator.fit.result import Estimate, ParameterEstimate
from estimator.fit.settings import FitSettings, material_of
from estimator.forward.meshing import mesh_experiment
from estimator.inference.free_parameter import NormalPrior
from estimator.materials import law_named

TRUTH = {"youngs_modulus": 12e3, "poisson_ratio": 0.46}
YEOH = {**TRUTH, "c2": 0.4}
# The data come from the fit's own mesh, so that there is no discretisation error to look for.
SAME_MESH = USUAL - {"discretisation"}
PLAIN = FitSettings(nuisances=SAME_MESH)


def coarse(experiment: Experiment) -> RetractionProblem:
    return mesh_experiment(experiment, COARSE_GRADING)


def estimate(experiments: list[Experiment], settings: FitSettings) -> Estimate:
    return whole.estimate(experiments, settings=settings, mesh=coarse)


@pytest.fixture(scope="module")
def problem() -> RetractionProblem:
    return coarse(SMALL_BLOCK)


def experiment_of(
    problem: RetractionProblem, law: str, values: dict[str, float], *, seed: int, noise: float = 1.0
) -> Experiment:
    """A pull with a turn, its rest included."""
    poses = turning_pull(SMALL_BLOCK, 0.015, np.radians([20.0, 0.0, 10.0]), 4)
    material = material_of(law_named(law), values)
    states = [EquilibriumSolver(problem).rest(material), *follow(problem, material, poses)]
    seen: list[Observation] = [observe(problem, state) for state in states]
    return recorded(SMALL_BLOCK, [s.pose for s in states], seen, np.random.default_rng(seed), noise=noise)


@pytest.fixture(scope="module")
def exact(problem: RetractionProblem) -> Experiment:
    return experiment_of(problem, "neo_hookean", TRUTH, seed=0, noise=0.0)


@pytest.fixture(scope="module")
def noisy(problem: RetractionProblem) -> Experiment:
    return experiment_of(problem, "neo_hookean", TRUTH, seed=1)


@pytest.fixture(scope="module")
def plain(noisy: Experiment) -> Estimate:
    return estimate([noisy], settings=PLAIN)


def width(of: ParameterEstimate) -> float:
    return of.interval95[1] - of.interval95[0]


def holds(of: ParameterEstimate, truth: float) -> bool:
    return of.interval95[0] < truth < of.interval95[1]


def test_the_parameters_of_a_stiffening_law_come_back(problem: RetractionProblem) -> None:
    experiment = experiment_of(problem, "yeoh2", YEOH, seed=0, noise=0.0)
    fit = estimate([experiment], settings=FitSettings(law=law_named("yeoh2"), nuisances=SAME_MESH))
    for name, truth in YEOH.items():
        assert fit.parameters[name].value == pytest.approx(truth, rel=2e-3)
    assert fit.law == "yeoh2"
    assert list(fit.shape) == ["c2"]
    assert fit.as_json()["shape"]["c2"]["value"] == fit.shape["c2"].value


def test_what_is_fixed_stays_and_makes_the_rest_better_known(noisy: Experiment, plain: Estimate) -> None:
    fit = estimate([noisy], settings=replace(PLAIN, fixed={"poisson_ratio": 0.46}))
    assert fit.poisson_ratio == ParameterEstimate(0.46, 0.0, (0.46, 0.46))
    assert fit.fixed == ("poisson_ratio",)
    assert width(fit.youngs_modulus) < width(plain.youngs_modulus)
    assert holds(fit.youngs_modulus, 12e3)


def test_a_fixed_modulus_leaves_the_ratio_to_the_fit(exact: Experiment) -> None:
    fit = estimate([exact], settings=replace(PLAIN, fixed={"youngs_modulus": 12e3}))
    assert fit.poisson_ratio.value == pytest.approx(0.46, abs=1e-4)


def test_a_prior_weighs_as_a_measurement_of_its_deviation(noisy: Experiment, plain: Estimate) -> None:
    """Two independent measurements: the mean weighted by inverse variances."""
    measured = plain.youngs_modulus
    prior = NormalPrior(measured.value * 1.05, measured.std)
    fit = estimate([noisy], settings=replace(PLAIN, priors={"youngs_modulus": prior}))
    expected = 1 / (1 / measured.std**2 + 1 / prior.std**2)
    assert fit.youngs_modulus.value == pytest.approx((measured.value + prior.mean) / 2, rel=5e-3)
    assert fit.youngs_modulus.std == pytest.approx(np.sqrt(expected), rel=0.1)


def test_a_parameter_that_rests_on_its_prior_is_named(noisy: Experiment) -> None:
    sure = replace(PLAIN, priors={"poisson_ratio": NormalPrior(0.46, 1e-5)})
    fit = estimate([noisy], settings=sure)
    assert any(s.startswith("ν rests on its prior") for s in fit.identifiability)


def test_bounds_hold_and_a_parameter_that_leans_on_one_is_named(noisy: Experiment) -> None:
    fit = estimate([noisy], settings=replace(PLAIN, bounds={"poisson_ratio": (0.3, 0.42)}))
    assert fit.poisson_ratio.value == 0.42
    assert fit.at_bound == ("poisson_ratio",)


@pytest.mark.parametrize("name", ["huber", "cauchy"])
def test_a_robust_loss_is_not_led_astray_by_outliers(noisy: Experiment, name: str) -> None:
    """One row in seven has a glitch of thirty deviations in fx, another lost a bead to its neighbour."""
    rng = np.random.default_rng(5)
    wrench, fiducials = noisy.wrench.copy(), noisy.fiducials.copy()
    hit = rng.random(len(wrench)) < 1 / 7
    wrench[hit, 0] += 30 * noisy.sensor.force_std
    lost = rng.random(len(wrench)) < 1 / 7
    fiducials[lost, 3] = fiducials[lost, 4]
    spoilt = replace(noisy, wrench=wrench, fiducials=fiducials)
    naive = estimate([spoilt], settings=PLAIN)
    robust = estimate([spoilt], settings=replace(PLAIN, loss=loss_named(name)))
    assert naive.noise_ratio > 3
    assert robust.noise_ratio == pytest.approx(1.0, abs=0.25)
    assert holds(robust.youngs_modulus, 12e3)
    assert holds(robust.poisson_ratio, 0.46)
    assert robust.floated is not None
    assert 0 < robust.floated.rejected_share < 0.1


@pytest.mark.parametrize("loss", LOSSES.values(), ids=LOSSES.keys())
def test_losses_let_go_of_what_is_far_and_know_what_that_costs(loss: Loss) -> None:
    """On normal noise of any size an M-estimate of a mean scatters as the variance factor says."""
    assert loss.weight(np.zeros(1)) == 1.0
    assert np.all(np.diff(loss.weight(np.linspace(0, 50, 200))) <= 0)
    rng = np.random.default_rng(0)
    for size in (1.0, 2.0):
        samples = size * rng.normal(size=(2000, 200))
        means = np.zeros(2000)
        for _ in range(60):
            weight = loss.weight(samples - means[:, None])
            means = np.sum(weight * samples, axis=1) / np.sum(weight, axis=1)
        left = samples - means[:, None]
        weight = loss.weight(left)
        believed = np.sum(weight * left**2) / np.sum(weight) / (200 * np.mean(weight))
        assert np.var(means) == pytest.approx(loss.variance_factor(left) * believed, rel=0.1)


def test_the_papers_objective_finds_the_truth_without_noise(exact: Experiment) -> None:
    fit = estimate([exact], settings=replace(PLAIN, objective="paper"))
    assert fit.youngs_modulus.value == pytest.approx(12e3, rel=1e-3)
    assert fit.poisson_ratio.value == pytest.approx(0.46, abs=1e-3)
    assert fit.objective == "paper"


def test_the_papers_objective_is_less_sure_than_the_likelihood(noisy: Experiment, plain: Estimate) -> None:
    fit = estimate([noisy], settings=replace(PLAIN, objective="paper"))
    for name, truth in TRUTH.items():
        assert holds(fit.parameters[name], truth)
        assert width(fit.parameters[name]) >= width(plain.parameters[name])


def test_profiles_agree_with_the_curvature_where_the_problem_is_nearly_linear(
    noisy: Experiment, plain: Estimate
) -> None:
    fit = estimate([noisy], settings=replace(PLAIN, intervals="profile"))
    for name in TRUTH:
        low, high = plain.parameters[name].interval95
        np.testing.assert_allclose(fit.parameters[name].interval95, [low, high], atol=0.1 * (high - low))
        assert fit.parameters[name].value == plain.parameters[name].value
    assert [one.name for one in fit.profiles] == list(TRUTH)
    for one in fit.profiles:
        values, rises = zip(*one.points, strict=True)
        assert list(values) == sorted(values)
        assert min(rises) == 0.0 < max(rises)


def test_force_gain_and_modulus_cannot_be_told_apart(noisy: Experiment, plain: Estimate) -> None:
    """Freed, the gain's prior of one per cent is what is left of what is known of E."""
    (sentence,) = [s for s in plain.identifiability if s.startswith("Force gain")]
    assert sentence.startswith("Force gain and E cannot be told apart: 1 % too much of it moves E by +1 %")
    fit = estimate([noisy], settings=replace(PLAIN, nuisances=SAME_MESH | {"force_gain"}))
    extra = fit.youngs_modulus.std**2 - plain.youngs_modulus.std**2
    assert np.sqrt(extra) == pytest.approx(0.01 * fit.youngs_modulus.value, rel=0.1)


def test_what_no_nuisance_takes_up_biases_the_fit(noisy: Experiment) -> None:
    """A tare of ten deviations: taken for what it is, or not."""
    tared = replace(noisy, wrench=np.add(noisy.wrench, [0.2, 0, 0, 0, 0, 0]))
    floating = estimate([tared], settings=PLAIN)
    rigid = estimate([tared], settings=replace(PLAIN, nuisances=SAME_MESH - {"tare"}))
    assert floating.floated is not None
    assert floating.floated.tares[0][0] == pytest.approx(0.2, rel=0.2)
    assert rigid.noise_ratio > floating.noise_ratio
    assert abs(rigid.youngs_modulus.value / 12e3 - 1) > 2 * abs(floating.youngs_modulus.value / 12e3 - 1)


def test_parameters_that_the_motion_does_not_determine_are_named(problem: RetractionProblem) -> None:
    """A pull of two millimetres strains the tissue too little to show how it stiffens."""
    material = material_of(law_named("neo_hookean"), TRUTH)
    poses = straight_pull(SMALL_BLOCK, 0.002, 2)
    states = [EquilibriumSolver(problem).rest(material), *follow(problem, material, poses)]
    seen = [observe(problem, state) for state in states]
    short = recorded(SMALL_BLOCK, [s.pose for s in states], seen, np.random.default_rng(0))
    yeoh = FitSettings(law=law_named("yeoh2"), nuisances=SAME_MESH)
    sentences = estimate([short], settings=yeoh).identifiability
    assert any("hardly determine c2" in sentence for sentence in sentences)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            {"fixed": {"c2": 0.1}},
            r"neo_hookean law has no parameter 'c2'; it has youngs_modulus, poisson_ratio",
        ),
        ({"fixed": {"poisson_ratio": 0.6}}, r"poisson_ratio = 0\.6 is outside -0\.5 to 0\.4999"),
        ({"fixed": TRUTH}, r"every parameter is fixed"),
        ({"bounds": {"poisson_ratio": (0.4, 0.3)}}, r"bounds of poisson_ratio: 0\.4 to 0\.3 must ascend"),
        (
            {"priors": {"poisson_ratio": NormalPrior(0.4, 0.0)}},
            r"prior of poisson_ratio: it needs a deviation above",
        ),
        (
            {"nuisances": frozenset({"drift"})},
            r"no nuisance is called 'drift'; choose from tare, rest_positions",
        ),
        ({"objective": "paper", "intervals": "profile"}, r"the paper's objective knows neither priors"),
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        FitSettings(**wrong)


def test_an_unknown_loss_lists_those_there_are() -> None:
    with pytest.raises(InputError, match=r"no loss is called 'tukey'; choose one of linear, huber, cauchy"):
        loss_named("tukey")


def test_two_experiments_float_a_tare_each(noisy: Experiment) -> None:
    other = replace(noisy, name="again", wrench=np.add(noisy.wrench, [0.0, 0.05, 0, 0, 0, 0]))
    fit = estimate([noisy, other], settings=PLAIN)
    assert fit.floated is not None
    first, second = fit.floated.tares
    assert second[1] - first[1] == pytest.approx(0.05, rel=0.2)
