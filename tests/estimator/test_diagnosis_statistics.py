"""The statistics of the diagnosis against closed forms and independent solvers."""

import numpy as np
import pytest
from effect_cases import there_and_back
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from estimator.diagnosis.conclusions.model_averaging import (
    over_answers,
    with_cause_left_open,
    with_form_left_open,
)
from estimator.diagnosis.conclusions.multiple_testing import multiplicity_of
from estimator.diagnosis.evidence.discrepancy import Discrepancy, ModelError, Moments, forgiven, moments_of
from estimator.diagnosis.evidence.floors import (
    log_evidence,
    over_floors,
    unknown_evidence,
    with_floor_borne_out,
)
from estimator.diagnosis.evidence.posterior import (
    credible_set,
    log_priors,
    of_labels,
    probabilities,
    shared_with_unknown,
)
from estimator.diagnosis.evidence.rivals import projected
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.noise.correlated_errors import left_beside_rim
from estimator.diagnosis.result import Material, Quantity
from estimator.diagnosis.search.screening import Trial, best_starts
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE, LABELS
from estimator.inference.bounded_minimum import bounded_minimum
from estimator.inference.laplace import Priors
from estimator.inference.whitening import Whitening, inverse_root, shrunk, uncorrelated

SETTINGS = DiagnosisSettings()

FloatArray = NDArray[np.float64]


def orthonormal(rng: np.random.Generator, rows: int, columns: int) -> FloatArray:
    return np.linalg.qr(rng.normal(size=(rows, columns)))[0]


def whitening_by(shared: FloatArray) -> Whitening:
    seen = np.ones((len(shared), 1), dtype=bool)
    return Whitening(seen, np.ones(1), np.zeros(1), *inverse_root(shared))


def test_shrinking_is_the_inverse_root_of_the_covariance() -> None:
    rng = np.random.default_rng(1)
    shared = rng.normal(size=(30, 4))
    vectors, shrink = inverse_root(shared)
    root = shrunk(np.eye(30), vectors, shrink)
    assert np.allclose(root @ (np.eye(30) + shared @ shared.T) @ root.T, np.eye(30))


def test_what_was_whitened_by_one_noise_is_whitened_anew_by_another() -> None:
    rng = np.random.default_rng(1)
    shared, columns = rng.normal(size=(30, 4)), rng.normal(size=(30, 3))
    more, less = (whitening_by(share * shared) for share in (1.0, 0.2))
    once = shrunk(columns, more.vectors, more.shrink)
    assert np.allclose(less.anew(once, more), shrunk(columns, less.vectors, less.shrink))
    for whitening, share in ((more, 1.0), (less, 0.2)):
        _, expected = np.linalg.slogdet(np.eye(30) + share**2 * shared @ shared.T)
        assert whitening.log_determinant == pytest.approx(expected)


def test_a_discrepancy_whitens_and_tells_its_determinant() -> None:
    rng = np.random.default_rng(2)
    wrench, vision = orthonormal(rng, 40, 3), orthonormal(rng, 40, 2)
    process = Discrepancy((wrench, vision[:, :0]), (np.array([4.0, 2.0, 1.0]), np.zeros(0)))
    error = ModelError((process,), ((0.1, 0.1),), (0.1, 0.1))
    gram, log_determinant = forgiven(error, moments_of(error, [np.eye(40)]), (1.5, 0.0))
    covariance = np.eye(40) + 1.5**2 * wrench @ np.diag([4.0, 2.0, 1.0]) @ wrench.T
    assert np.allclose(gram @ covariance, np.eye(40))
    assert log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1])


def test_discrepancies_of_wrench_and_fiducials_whiten_one_after_the_other() -> None:
    rng = np.random.default_rng(21)
    vectors = orthonormal(rng, 40, 3), orthonormal(rng, 40, 5)
    eigenvalues = np.array([4.0, 2.0, 1.0]), np.array([9.0, 3.0, 1.0, 0.5, 0.1])
    error = ModelError((Discrepancy(vectors, eigenvalues),), ((0.1, 0.1),), (0.1, 0.1))
    columns = rng.normal(size=(40, 6))
    gram, _ = forgiven(error, moments_of(error, [columns]).among([4, 0, 1]), (1.5, 0.7))
    whitened = columns[:, [4, 0, 1]]
    for v, e, s in zip(vectors, eigenvalues, (1.5, 0.7), strict=True):
        whitened = shrunk(whitened, v, 1.0 - 1.0 / np.sqrt(1.0 + s**2 * e))
    assert np.allclose(gram, whitened.T @ whitened)


def linear(
    error: ModelError, residual: FloatArray, columns: FloatArray, scale: FloatArray
) -> tuple[Moments, Priors]:
    free = np.full(columns.shape[1], np.inf)
    moments = moments_of(error, [np.column_stack([residual, columns])])
    return moments, Priors(
        np.isinf(scale),
        np.zeros(len(scale)),
        scale,
        -free,
        free,
        np.where(np.isinf(scale), -1, 0),
        SETTINGS.evidence.sizes,
        SETTINGS.evidence.shows,
    )


def test_the_evidence_of_a_linear_effect_is_that_of_the_joint_normal() -> None:
    # With a wide prior in place of the flat one of E and nu, the marginal of the data is a normal in closed form.
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(25, 3))
    residual = rng.normal(size=25) + columns @ [3.0, -2.0, 0.8]
    none = Discrepancy((np.zeros((25, 0)),) * 2, (np.zeros(0),) * 2)
    error = ModelError((none,), ((0.0, 0.0),), (0.0, 0.0))
    wide, scale = 1e3, 0.7
    with_effect = linear(error, residual, columns, np.array([np.inf, np.inf, scale]))
    without = linear(error, residual, columns[:, :2], np.array([np.inf, np.inf]))
    gain = log_evidence(*with_effect, error, (0.0, 0.0)) - log_evidence(*without, error, (0.0, 0.0))

    def exact(prior: list[float], used: FloatArray) -> float:
        covariance = np.eye(25) + used @ np.diag(np.square(prior)) @ used.T
        return float(multivariate_normal.logpdf(residual, cov=covariance))

    # What E and nu leave of the effect's column tells by how much each size stands out; what does not is no effect.
    left = columns[:, 2] - columns[:, :2] @ np.linalg.lstsq(columns[:, :2], columns[:, 2])[0]
    shares = np.array([1.0, 0.3, 0.1, 0.03])
    squared = (shares * scale) ** 2 * (left @ left)
    sizes = [exact([wide, wide, share * scale], columns) for share in shares]
    expected = (
        logsumexp(sizes, b=squared / (squared + 4.0)) - np.log(4.0) - exact([wide, wide], columns[:, :2])
    )
    assert gain == pytest.approx(expected, abs=1e-3)


def test_an_effect_whose_every_size_is_too_small_to_show_is_no_explanation() -> None:
    rng = np.random.default_rng(8)
    columns, residual = rng.normal(size=(25, 3)), rng.normal(size=25)
    error = ModelError(
        (Discrepancy((np.zeros((25, 0)),) * 2, (np.zeros(0),) * 2),), ((0.0, 0.0),), (0.0, 0.0)
    )
    without = log_evidence(*linear(error, residual, columns[:, :2], np.full(2, np.inf)), error, (0.0, 0.0))
    hidden = linear(error, residual, columns, np.array([np.inf, np.inf, 1e-3]))
    assert log_evidence(*hidden, error, (0.0, 0.0)) < without - 8.0


def smooth_misfits(
    rng: np.random.Generator, largest_floor: float
) -> tuple[ModelError, FloatArray, FloatArray]:
    """Return the error of a model whose misfit would lie along 30 of 400 directions, those, and the derivatives."""
    directions, columns = orthonormal(rng, 400, 30), rng.normal(size=(400, 2))
    process = Discrepancy((directions, np.zeros((400, 0))), (np.full(30, 400 / 30), np.zeros(0)))
    floors = [(share * largest_floor, share * largest_floor) for share in (1.0, 0.3, 0.03)]
    return ModelError((process,), tuple(floors), floors[0]), directions, columns


def test_noise_alone_is_not_unknown_however_large_an_error_the_model_is_taken_to_have() -> None:
    rng = np.random.default_rng(6)
    error, _, columns = smooth_misfits(rng, largest_floor=4.0)
    baseline = linear(error, rng.normal(size=400), columns, np.array([np.inf, np.inf]))
    assert with_floor_borne_out(error, *baseline).floor == error.floors[-1]
    assert unknown_evidence(*baseline, error) < over_floors(*baseline, error)


def test_a_misfit_beyond_the_floor_is_unknown_and_leaves_the_floor_where_it_was() -> None:
    rng = np.random.default_rng(7)
    error, directions, columns = smooth_misfits(rng, largest_floor=0.3)
    misfit = directions @ rng.normal(0.0, 2.0 * np.sqrt(400 / 30), size=30)
    baseline = linear(error, rng.normal(size=400) + misfit, columns, np.array([np.inf, np.inf]))
    assert with_floor_borne_out(error, *baseline).floor == error.floors[0]
    assert unknown_evidence(*baseline, error) > over_floors(*baseline, error) + 20.0


@pytest.mark.parametrize("seed", range(8))
def test_the_bounded_minimum_is_that_of_a_general_solver(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design, target = rng.normal(size=(20, 5)), rng.normal(size=20)
    lower, upper = np.array([-np.inf, 0.0, -0.1, 0.0, -0.2]), np.array([np.inf, np.inf, 0.1, 0.3, 0.0])
    found = bounded_minimum(design.T @ design, design.T @ target, lower, upper)
    assert np.allclose(found, lsq_linear(design, target, (lower, upper), tol=1e-14).x, atol=1e-6)


def test_priors_sum_to_one_and_labels_share_alike() -> None:
    first, *_ = LABELS
    prior = {name: float(np.exp(value)) for name, value in log_priors(LABELS, SETTINGS.evidence).items()}
    assert sum(prior.values()) == pytest.approx(1.0)
    assert len({prior[label] for label in LABELS}) == 1
    assert prior[first] < prior["unknown"] < prior["none"]


def test_the_unknown_leads_where_it_explains_more_than_the_cause_that_it_stands_beside() -> None:
    named = {"a": 0.98, "none": 0.01, "unknown": 0.01}
    little = shared_with_unknown(named, "a", explained=90.0, beyond=10.0)
    much = shared_with_unknown(named, "a", explained=30.0, beyond=70.0)
    assert next(iter(little)) == "a"
    assert next(iter(much)) == "unknown"
    assert sum(little.values()) == pytest.approx(1.0)
    assert little["a"] == pytest.approx(0.9 * 0.98)


def test_the_credible_set_holds_what_is_needed_and_no_more() -> None:
    evidence = {"none": 0.0, "unknown": -3.0, "a": 4.0, "b": 3.9, "c": -9.0}
    chances = probabilities(evidence, SETTINGS.evidence)
    chosen = credible_set(chances, SETTINGS.evidence.credible)
    assert sum(chances.values()) == pytest.approx(1.0)
    assert sum(chances[name] for name in chosen) >= 0.9
    assert sum(chances[name] for name in chosen[:-1]) < 0.9
    assert set(chosen[:2]) == {"a", "b"}


def test_rivals_that_explain_much_need_to_differ_by_more() -> None:
    def odds(gain: float) -> float:
        chances = probabilities(
            {"none": 0.0, "unknown": -9.0, "a": gain, "b": gain - 8.0, "c": -9.0}, SETTINGS.evidence
        )
        return chances["a"] / chances["b"]

    # A fiftieth of what the better explains is as much as signatures are inexact by.
    assert odds(20.0) == pytest.approx(np.exp(8.0 / 1.4), rel=1e-4)
    assert odds(100.0) == pytest.approx(np.exp(8.0 / 3.0))
    assert odds(1e4) == pytest.approx(np.exp(8.0 * 0.15))


def test_an_effect_too_small_to_show_may_always_be_there() -> None:
    nothing = probabilities({"none": 0.0, "unknown": -5.0, **dict.fromkeys(LABELS, -30.0)}, SETTINGS.evidence)
    hidden, unknown = 0.05 * (1 - 0.5 - 0.11), 0.11 * np.exp(-5.0)
    assert nothing["none"] == pytest.approx(0.5 / (0.5 + hidden + unknown))
    assert all(nothing[label] > 0.001 for label in LABELS)


def test_the_one_that_explains_a_little_comes_before_those_that_explain_nothing() -> None:
    nothing = {"none": 0.0, "unknown": -5.0, **dict.fromkeys(LABELS, -3.0)}
    for label in LABELS:
        assert list(probabilities({**nothing, label: -0.5}, SETTINGS.evidence))[:2] == ["none", label]


def test_forms_of_a_label_that_explain_alike_are_worth_one() -> None:
    assert of_labels([("a", "this", 5.0), ("a", "that", 5.0)], none=0.0, settings=SETTINGS.evidence)[
        "a"
    ] == pytest.approx(5.0)


@pytest.mark.parametrize("gain", [8.0, 100.0])
def test_one_form_of_a_label_that_alone_explains_has_its_share_of_the_prior(gain: float) -> None:
    forms = [("a", "this", gain), ("a", "that", -50.0), ("b", "other", gain)]
    chances = probabilities(
        {"none": 0.0, "unknown": -9.0, **of_labels(forms, none=0.0, settings=SETTINGS.evidence)},
        SETTINGS.evidence,
    )
    assert chances["a"] / chances["b"] == pytest.approx(0.5, rel=0.01)


def test_more_starts_of_one_form_are_worth_the_best() -> None:
    assert of_labels([("a", "this", 5.0), ("a", "this", 4.0)], none=0.0, settings=SETTINGS.evidence)[
        "a"
    ] == pytest.approx(5.0)


def test_innovations_of_correlated_rows_are_white_also_across_gaps() -> None:
    rng = np.random.default_rng(5)
    seen = rng.random((40, 2)) > 0.2
    correlation = np.array([0.6, 0.0])
    times = np.arange(40)
    covariance = 0.6 ** np.abs(times[:, None] - times[None])
    root = np.linalg.cholesky(covariance)
    columns = np.zeros((40, 2, 40))
    columns[:, 0] = root
    columns[:, 1] = np.eye(40)
    white = uncorrelated(columns, seen, correlation)[np.nonzero(seen)[1] == 0]
    assert np.allclose(white @ white.T, np.eye(seen[:, 0].sum()))


def chance(residual: FloatArray, nuisances: FloatArray, signatures: list[FloatArray], seed: int = 0) -> float:
    columns = np.column_stack([residual, nuisances, *signatures])
    sizes = [signature.shape[1] for signature in signatures]
    rivals, seen = projected(columns.T @ columns, nuisances.shape[1], [""] * len(sizes), sizes)
    return multiplicity_of(rivals, seen, SETTINGS.conclusions, seed).chance


def test_among_many_tests_noise_alone_is_significant_in_one_case_of_twenty() -> None:
    rng = np.random.default_rng(11)
    nuisances = rng.normal(size=(60, 2))
    shared = rng.normal(size=(60, 1))
    # many effects that resemble each other, and some with several amplitudes
    signatures = [shared + 0.3 * rng.normal(size=(60, 1 + number % 3)) for number in range(12)]
    chances = np.array([chance(rng.normal(size=60), nuisances, signatures, seed) for seed in range(100)])
    assert 1 <= np.sum(chances < 0.05) <= 12
    assert abs(np.mean(chances) - 0.5) < 0.1


def test_a_real_effect_is_no_chance_and_one_along_a_nuisance_is_not_seen() -> None:
    rng = np.random.default_rng(12)
    nuisances, signature = rng.normal(size=(60, 2)), rng.normal(size=(60, 1))
    noise = rng.normal(size=60)
    others = [rng.normal(size=(60, 1)) for _ in range(10)]
    assert chance(noise + 2.0 * signature[:, 0], nuisances, [signature, *others]) == 0.0
    along = [nuisances[:, :1], *others]
    swallowed = chance(noise + 50.0 * nuisances[:, 0], nuisances, along)
    assert swallowed == chance(noise, nuisances, along)


def test_of_each_effect_the_best_start_is_tried_and_two_where_constants_are_searched() -> None:
    inclusion = next(effect for effect in CATALOGUE if effect.name == "inhomogeneity:cylinder")
    scale = next(effect for effect in CATALOGUE if effect.name == "camera_scale:uniform")
    start = Hypothesis(1e4, 0.45)
    trials = [
        Trial(Signature(effect, {}, (), ()), evidence, start)
        for effect, evidence in (
            (scale, 1.0),
            (inclusion, 5.0),
            (inclusion, 2.0),
            (scale, 3.0),
            (inclusion, 4.0),
        )
    ]
    found = [(trial.signature.effect.label, trial.log_evidence) for trial in best_starts(trials, 2)]
    assert found == [("inhomogeneity", 5.0), ("inhomogeneity", 4.0), ("camera_scale", 3.0)]


def test_beads_at_the_rim_of_the_grasp_are_forgiven_what_meshes_make_of_them_as_the_gripper_goes() -> None:
    # Where the solution is singular even fine meshes differ, by half of the largest correction.
    experiment = there_and_back().experiment
    beads = experiment.fiducials_rest
    correction = np.zeros((len(experiment.time), 6 + 3 * len(beads)))
    correction[:, 6::3] = 1e-5 * np.sin(np.linspace(0.0, np.pi, len(correction)))[:, None]
    of_beads = left_beside_rim(experiment, correction, SETTINGS.noise)
    at_corner = np.isclose(beads[:, 0], 0.03) & (np.abs(beads[:, 1]) < 0.011)
    assert list(of_beads) == list(np.flatnonzero(at_corner))
    assert len(of_beads) == 2
    for bead, directions in of_beads.items():
        size = np.linalg.norm(directions, axis=2)
        farthest = size[22, 6:].reshape(-1, 3)
        assert farthest[bead] == pytest.approx(0.5e-5, rel=1e-2)
        assert np.all(np.delete(farthest, bead, axis=0) == 0.0)
        assert np.all(size[0] == 0.0)
        *waves, back = np.moveaxis(directions.reshape(*correction.shape, 3, -1), -1, 0)
        # It depends on where the gripper is, and, as tissue may remember, on how far it has come back.
        for wave in waves:
            assert wave[10] == pytest.approx(wave[35])
        assert np.all(back[:23] == 0.0)
        assert np.linalg.norm(back[-1]) == pytest.approx(np.sqrt(3.0) * 0.5e-5, rel=0.05)


def material(modulus: float, ratio: float) -> Material:
    return Material(Quantity(modulus, 100.0, "Pa"), Quantity(ratio, 0.003, "1"))


def test_a_probable_rival_widens_what_is_said_of_the_material_and_an_improbable_one_does_not() -> None:
    chosen, rival = material(26_000.0, 0.48), material(25_000.0, 0.46)
    probable = over_answers(chosen, {"slip": rival}, {"yield": 0.8, "slip": 0.2})
    assert probable.youngs_modulus.value == 26_000.0
    assert probable.youngs_modulus.std == pytest.approx(np.sqrt(100.0**2 + 0.2 * 1000.0**2))
    assert probable.poisson_ratio.std == pytest.approx(np.sqrt(0.003**2 + 0.2 * 0.02**2))
    assert over_answers(chosen, {"slip": rival}, {"yield": 1.0, "slip": 0.0}) == chosen
    # an answer of which nothing is known counts as the chosen one
    assert over_answers(chosen, {}, {"yield": 0.5, "unknown": 0.5}) == chosen


def test_a_cause_that_changes_the_material_by_much_leaves_a_tenth_of_that_open() -> None:
    baseline = material(25_000.0, 0.46)
    found = with_form_left_open(material(26_000.0, 0.43), baseline, 0.1)
    assert found.youngs_modulus == Quantity(26_000.0, pytest.approx(np.hypot(100.0, 100.0)), "Pa")
    assert found.poisson_ratio == Quantity(0.43, pytest.approx(np.hypot(0.003, 0.003)), "1")
    assert with_form_left_open(baseline, baseline, 0.1) == baseline


def test_something_unknown_may_have_changed_the_material_as_the_causes_that_were_tried_would() -> None:
    baseline = material(25_000.0, 0.46)
    found = with_cause_left_open(baseline, [material(25_300.0, 0.46), material(24_900.0, 0.48)])
    assert found.youngs_modulus.value == 25_000.0
    assert found.youngs_modulus.std == pytest.approx(np.sqrt(100.0**2 + (300.0**2 + 100.0**2) / 2))
    assert found.poisson_ratio.std == pytest.approx(np.sqrt(0.003**2 + 0.02**2 / 2))
    assert with_cause_left_open(baseline, []) == baseline


def test_what_moves_to_the_unknown_leaves_no_negative_probability() -> None:
    for none in np.random.default_rng(1).uniform(0.0, 1.0, 200):
        shared = shared_with_unknown({"none": none, "unknown": 1.0 - none}, "none", 0.0, 14.3)
        assert shared["none"] == 0.0
        assert shared["unknown"] == pytest.approx(1.0)
