"""The statistics of the fit by themselves: whitening, marginalisation, coverage, steps and bounds."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, straight_pull, turning_pull, with_rows

from estimator.errors import FitError, SolverError
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.equilibrium.observation import Observation
from estimator.fit.linearised_fit import LinearisedFit, linearised_fit, whitenings_of
from estimator.fit.measurements import StateMean, state_means
from estimator.fit.search import at_values, determined_step, minimise, moved
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import schedule_poses
from estimator.inference.channels import channels_by, predicted_channels
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.gauss_newton import newton_step
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

PARAMETERS = (YOUNGS_MODULUS, POISSON_RATIO)
TRUTH = {"youngs_modulus": 12e3, "poisson_ratio": 0.46}
FREE = at_values(PARAMETERS, TRUTH)
ROWS = 3


def unmeasured(poses: list[GripperPose]) -> Experiment:
    """An experiment with ``ROWS`` rows a pose whose measurements nobody looks at."""
    rows = [pose for pose in poses for _ in range(ROWS)]
    return with_rows(SMALL_BLOCK, rows, np.zeros((len(rows), 6)), np.zeros((len(rows), 9, 3)))


@pytest.fixture(scope="module")
def experiments() -> list[Experiment]:
    pull = straight_pull(SMALL_BLOCK, 0.012, 4)
    twist = turning_pull(SMALL_BLOCK, 0.009, np.radians([25.0, 0.0, 10.0]), 4)
    return [unmeasured(pull), unmeasured(twist)]


@pytest.fixture(scope="module")
def predictions(experiments: list[Experiment]) -> list[dict[int, Observation]]:
    model = ForwardModel(mesh_experiment(SMALL_BLOCK), experiments)
    material = Material(NeoHookean(), TRUTH["youngs_modulus"], TRUTH["poisson_ratio"])
    return model.predict(material, [range(4), range(4)])


@pytest.fixture(scope="module")
def means(experiments: list[Experiment]) -> list[StateMean]:
    return state_means(experiments, [schedule_poses(experiment) for experiment in experiments])


def by_position(seen: Observation) -> FloatArray:
    return np.vstack([seen.wrench_by_pose[:, :3], seen.fiducials_by_pose[:, :, :3].reshape(-1, 3)])


def with_errors(
    means: list[StateMean], predictions: list[dict[int, Observation]], rng: np.random.Generator
) -> list[StateMean]:
    """Measurements of the predicted states with every error of the stated size: the model of ``residuals``, by hand."""
    deviation = np.sqrt(means[0].variance)
    tares = [deviation[:6] * rng.normal(size=6) for _ in predictions]
    offsets = deviation[6:] * rng.normal(size=len(deviation) - 6)
    result = []
    for mean in means:
        seen = predictions[mean.experiment][mean.state]
        misplaced = SMALL_BLOCK.sensor.position_std * rng.normal(size=3) / math.sqrt(ROWS)
        noise = deviation * rng.normal(size=len(deviation)) / math.sqrt(ROWS)
        constant = np.concatenate([tares[mean.experiment], offsets])
        result.append(
            replace(mean, mean=predicted_channels(seen) + by_position(seen) @ misplaced + constant + noise)
        )
    return result


def whitened(means: list[StateMean], predictions: list[dict[int, Observation]]) -> LinearisedFit:
    return linearised_fit(means, predictions, FREE, whitenings_of(means, predictions))


def test_rows_of_one_pose_become_one_mean_that_counts_what_was_measured() -> None:
    experiment = unmeasured(straight_pull(SMALL_BLOCK, 0.012, 2))
    wrench = np.arange(36.0).reshape(6, 6)
    wrench[1, 2] = wrench[3:, 4] = np.nan
    first, second = state_means([replace(experiment, wrench=wrench)], [schedule_poses(experiment)])
    np.testing.assert_array_equal(first.mean[:6], [6, 7, 8, 9, 10, 11])
    assert first.count[:6].tolist() == [3, 3, 2, 3, 3, 3]
    assert second.count[:6].tolist() == [3, 3, 3, 3, 0, 3]
    assert np.isnan(second.mean[4])
    assert first.variance[0] == pytest.approx(0.02**2)
    assert first.variance[3] == pytest.approx(5e-4**2)
    assert first.variance[6] == pytest.approx(5e-5**2)
    assert first.pose_variance == pytest.approx([3e-5**2 / 3] * 3 + [0.0] * 3)


def test_whitening_and_marginalising_are_generalised_least_squares_with_the_whole_covariance(
    means: list[StateMean], predictions: list[dict[int, Observation]]
) -> None:
    """By brute force: one dense covariance of all channels of all states, missing ones left out."""
    rng = np.random.default_rng(1)
    measured = with_errors(means, predictions, rng)
    lost = measured[2].count.copy()
    lost[[1, 9, 10]] = 0
    measured[2] = replace(measured[2], count=lost)
    residual, derivative, seen = [], [], []
    for mean in measured:
        observation = predictions[mean.experiment][mean.state]
        residual.append(mean.mean - predicted_channels(observation))
        derivative.append(np.stack([channels_by(observation, p.name) * p.slope for p in FREE], axis=1))
        seen.append(mean.count > 0)
    channels = len(residual[0])
    covariance = np.zeros((len(measured) * channels,) * 2)
    for a, one in enumerate(measured):
        for b, other in enumerate(measured):
            block = np.zeros((channels, channels))
            if one.experiment == other.experiment:
                block[:6, :6] += np.diag(one.variance[:6])  # the common tare
            block[6:, 6:] += np.diag(one.variance[6:])  # the common rest offsets
            if a == b:
                by = by_position(predictions[one.experiment][one.state])
                block += np.diag(one.variance) / ROWS + SMALL_BLOCK.sensor.position_std**2 / ROWS * by @ by.T
            covariance[a * channels : (a + 1) * channels, b * channels : (b + 1) * channels] = block
    kept = np.concatenate(seen)
    inverse = np.linalg.inv(covariance[np.ix_(kept, kept)])
    J, r = np.concatenate(derivative)[kept], np.concatenate(residual)[kept]
    information = J.T @ inverse @ J
    step = np.linalg.solve(information, J.T @ inverse @ r)

    found = newton_step(whitened(measured, predictions))
    np.testing.assert_allclose(found.information, information, rtol=1e-7)
    np.testing.assert_allclose(found.step, step, rtol=1e-6)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(information), rtol=1e-7)
    assert found.chi2 == pytest.approx(r @ inverse @ r, rel=1e-8)
    left = r - J @ step
    assert found.chi2_after == pytest.approx(left @ inverse @ left, rel=1e-8)


def test_ninety_five_percent_intervals_hold_the_truth_that_often(
    means: list[StateMean], predictions: list[dict[int, Observation]]
) -> None:
    """Over 400 sets of errors; derivatives and covariances are those of the true state in all of them."""
    rng = np.random.default_rng(2)
    whitenings = whitenings_of(means, predictions)
    exact = [predicted_channels(predictions[mean.experiment][mean.state]) for mean in means]
    problem = whitened(with_errors(means, predictions, rng), predictions)
    scores, misfits = [], []
    for _ in range(400):
        measured = with_errors(means, predictions, rng)
        residual = [
            whitenings[mean.experiment, mean.state].residual(mean.mean[None], e[None])
            for mean, e in zip(measured, exact, strict=True)
        ]
        (whole,) = problem.whitened(np.concatenate(residual)[:, None]).T
        found = newton_step(replace(problem, residual=(whole,)))
        scores.append(found.step / np.sqrt(np.diag(found.covariance)))
        misfits.append(found.chi2_after / (len(whole) - 2))
    covered = np.mean(np.abs(scores) < 1.96, axis=0)
    assert np.all((covered > 0.92) & (covered < 0.98))
    assert np.mean(misfits) == pytest.approx(1.0, abs=0.02)


def test_states_that_were_not_predicted_are_left_out(
    means: list[StateMean], predictions: list[dict[int, Observation]]
) -> None:
    measured = with_errors(means, predictions, np.random.default_rng(3))
    few = [{0: predictions[0][0]}, {3: predictions[1][3]}]
    chosen = [measured[0], measured[7]]
    np.testing.assert_array_equal(
        whitened(measured, few).residual[0], whitened(chosen, predictions).residual[0]
    )


def test_internal_variables_and_slopes_belong_together() -> None:
    for parameter, value in ((YOUNGS_MODULUS, 15e3), (POISSON_RATIO, 0.3), (POISSON_RATIO, 0.4999)):
        transform = parameter.transform
        internal = transform.internal_of(value)
        assert transform.value_of(internal) == pytest.approx(value, rel=1e-12)
        quotient = (transform.value_of(internal + 1e-5) - transform.value_of(internal - 1e-5)) / 2e-5
        assert parameter.at(value).slope == pytest.approx(quotient, rel=1e-6)


LENGTH = FreeParameter(name="length", value=0.0, lower=-10.0, upper=10.0, longest_step=1.5)


def of_length(length: float, residual: float, slope: float) -> LinearisedFit:
    return LinearisedFit.of([LENGTH.at(length)], np.array([residual]), np.array([[slope]]))


def test_a_curved_problem_is_minimised_in_shortened_steps() -> None:
    """arctan pulls a full Gauss–Newton step from 3 far to the other side."""

    def linearise(values: Mapping[str, float]) -> LinearisedFit:
        x = values["length"]
        return of_length(x, -10 * math.atan(x), 10 / (1 + x * x))

    iterates, last = minimise(linearise, (LENGTH,), {"length": 3.0}, 1e-6)
    assert iterates[-1].values["length"] == pytest.approx(0.0, abs=1e-5)
    assert np.all(np.diff([iterate.chi2 for iterate in iterates]) < 0)
    assert last.chi2 == pytest.approx(0.0, abs=1e-8)


def test_a_step_into_where_nothing_can_be_solved_is_shortened() -> None:
    asked = []

    def linearise(values: Mapping[str, float]) -> LinearisedFit:
        x = values["length"]
        asked.append(x)
        if x > 0.5:
            raise SolverError("no equilibrium")
        return of_length(x, 0.4 - x, 0.5)

    iterates, _ = minimise(linearise, (LENGTH,), {"length": 0.0}, 1e-3)
    assert max(asked) > 0.5
    assert iterates[-1].values["length"] == pytest.approx(0.4, abs=1e-3)


def test_a_problem_that_nothing_improves_ends_with_the_reason() -> None:
    def wrong_slope(values: Mapping[str, float]) -> LinearisedFit:
        return of_length(values["length"], 1.0 - values["length"], -1.0)

    with pytest.raises(FitError, match=r"no step from length = 0 lowers the misfit; the data contradict"):
        minimise(wrong_slope, (LENGTH,), {"length": 0.0}, 1e-3)


def test_a_parameter_at_its_bound_is_held_and_the_others_go_on() -> None:
    nu = POISSON_RATIO.upper
    jacobian = np.array([[1.0, 0.8], [0.0, 0.6]])
    here = {"youngs_modulus": 1e4, "poisson_ratio": nu}
    problem = LinearisedFit.of(at_values(PARAMETERS, here), np.array([0.2, 0.3]), jacobian)
    np.testing.assert_allclose(newton_step(problem).step, [0.2, 0.0], atol=1e-15)
    after = moved(PARAMETERS, here, np.array([0.2, 5.0]))
    assert after["poisson_ratio"] == nu
    assert after["youngs_modulus"] == pytest.approx(1e4 * math.exp(0.2))


def test_data_that_do_not_tell_the_parameters_apart_are_refused() -> None:
    jacobian = np.array([[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]])
    with pytest.raises(FitError, match="do not determine the parameters"):
        determined_step(LinearisedFit.of(FREE, np.ones(3), jacobian))
