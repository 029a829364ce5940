"""The whitened misfit between measurements and prediction, with the nuisances that every laboratory has.

All rows of one state have one prediction, so their mean per channel carries all that they say about it. With n rows,
prediction f(θ) and its derivative T by the gripper's position, a state's mean measurement is

    ȳ = f(θ) + T δ + tare + rest offsets + noise,     cov = σ²/n + T Tᵀ σ_p²/n

where δ is the error of the reported position (σ_p a row), the tare is that of the experiment (the sensor was zeroed
with the noise of a row), and the rest offsets are those of the beads' stated rest positions. δ goes into the
covariance; the others are free, with priors (:mod:`estimator.fit.nuisances`). Least squares over all states then is the
marginal maximum likelihood (Kaipio & Somersalo 2005, section 5.8).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from estimator.experiment import Experiment
from estimator.fem.equilibrium.observation import Observation
from estimator.fit.nuisances import USUAL, FloatingNuisance, floating, nuisance_columns
from estimator.forward.schedule import PoseSchedule

FloatArray = NDArray[np.float64]
# Cholesky roots of covariances by (experiment, state).
Roots = Mapping[tuple[int, int], FloatArray]
# For each experiment, the observation of each solved state.
Predictions = Sequence[Mapping[int, Observation]]


@dataclass(frozen=True)
class StateMean:
    """What was measured at one state.

    Attributes
    ----------
    experiment : number of the experiment in the case
    state : number of the state in its schedule
    mean : (c,) means of the six wrench channels and 3m fiducial coordinates, NaN where nothing was measured
    count : (c,) rows that made them; where a robust loss weighs them, the sum of their weights
    variance : (c,) of one row, from the sensor's stated noise
    position_variance : of the mean position of the gripper, m²
    """

    experiment: int
    state: int
    mean: FloatArray
    count: FloatArray
    variance: FloatArray
    position_variance: float


@dataclass(frozen=True)
class WhitenedSystem:
    """The linearised least-squares problem.

    Attributes
    ----------
    residual : (r,) measured minus predicted, unit variance
    by_parameter : (r, p) derivative of the prediction by each internal parameter
    by_nuisance : (r, k) derivative by each nuisance in units of its prior's standard deviation
    """

    residual: FloatArray
    by_parameter: FloatArray
    by_nuisance: FloatArray


def state_means(
    experiments: Sequence[Experiment],
    schedules: Sequence[PoseSchedule],
    weights: Sequence[FloatArray] | None = None,
) -> list[StateMean]:
    """Average the rows of every state of every experiment.

    Parameters
    ----------
    weights : for each experiment those of its rows' channels, (n, 6 + 3m) in [0, 1]; all one where not given
    """
    means = []
    for number, (experiment, schedule) in enumerate(zip(experiments, schedules, strict=True)):
        rows = measured_rows(experiment)
        weight = np.isfinite(rows) * (1.0 if weights is None else weights[number])
        variance = channel_variance(experiment)
        for state in range(len(schedule.poses)):
            of_state = schedule.state_of_row == state
            position_std = experiment.sensor.position_std
            means.append(
                mean_of_rows(number, state, rows[of_state], weight[of_state], variance, position_std)
            )
    return means


def mean_of_rows(
    experiment: int,
    state: int,
    rows: FloatArray,
    weights: FloatArray,
    variance: FloatArray,
    position_std: float,
) -> StateMean:
    """Average the rows (n, c) of one state with their weights, zero where nothing was measured."""
    count = weights.sum(axis=0)
    total = np.nansum(weights * rows, axis=0)
    mean = np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
    return StateMean(experiment, state, mean, count, variance, position_std**2 / len(rows))


def measured_rows(experiment: Experiment) -> FloatArray:
    """Return wrench and fiducials side by side, (n, 6 + 3m)."""
    return np.hstack([experiment.wrench, experiment.fiducials.reshape(len(experiment.time), -1)])


def channel_variance(experiment: Experiment) -> FloatArray:
    """Return the stated variance of each channel of one row, (6 + 3m,)."""
    sensor = experiment.sensor
    deviations = [sensor.force_std] * 3 + [sensor.torque_std] * 3
    deviations += [sensor.fiducial_std] * (3 * len(experiment.fiducials_rest))
    return np.square(deviations)


def predicted_channels(observation: Observation) -> FloatArray:
    """Return a prediction in the order of :func:`measured_rows`, (6 + 3m,)."""
    return np.concatenate([observation.wrench, observation.fiducials.reshape(-1)])


def channels_by(observation: Observation, name: str) -> FloatArray:
    """Return the derivative of :func:`predicted_channels` by a material parameter."""
    return np.concatenate([observation.wrench_by[name], observation.fiducials_by[name].reshape(-1)])


def channels_by_position(observation: Observation) -> FloatArray:
    """Return the derivative of :func:`predicted_channels` by the gripper's position, (6 + 3m, 3)."""
    by_pose = [observation.wrench_by_pose, observation.fiducials_by_pose.reshape(-1, 6)]
    return np.concatenate(by_pose)[:, :3]


def covariance_roots(means: Sequence[StateMean], predictions: Predictions) -> Roots:
    """Return the Cholesky root of the covariance of every predicted state's mean, by (experiment, state).

    It depends on the prediction through its derivative by the gripper's position. A fit keeps it fixed, so that its
    misfit is a function of the parameters that a Gauss–Newton step lowers.
    """
    roots = {}
    for mean in means:
        observation = predictions[mean.experiment].get(mean.state)
        if observation is None:
            continue
        seen = mean.count > 0
        by_position = channels_by_position(observation)[seen]
        noise = np.diag(mean.variance[seen] / mean.count[seen])
        covariance = noise + mean.position_variance * by_position @ by_position.T
        root = np.linalg.cholesky(covariance)
        roots[mean.experiment, mean.state] = np.asarray(root, dtype=np.float64)
    return roots


def whiten(
    means: Sequence[StateMean],
    predictions: Predictions,
    slopes: Mapping[str, float],
    roots: Roots,
    nuisances: Sequence[FloatingNuisance] = floating(USUAL),
) -> WhitenedSystem:
    """Set up the least-squares problem for the states that were predicted.

    Parameters
    ----------
    means : of all states
    predictions : of the states in use
    slopes : derivative of each parameter by its internal variable; its order is that of the columns
    roots : of the covariances, from :func:`covariance_roots`
    nuisances : that float
    """

    def columns(mean: StateMean, observation: Observation) -> FloatArray:
        error = mean.mean - predicted_channels(observation)
        derivative = [channels_by(observation, name) * slope for name, slope in slopes.items()]
        deviation = np.sqrt(mean.variance)
        floats = nuisance_columns(nuisances, deviation, observation, mean.experiment, len(predictions))
        return np.column_stack([error, *derivative, floats])

    system = whitened_rows(means, predictions, roots, columns)
    parameters = 1 + len(slopes)
    return WhitenedSystem(system[:, 0], system[:, 1:parameters], system[:, parameters:])


def whitened_rows(
    means: Sequence[StateMean],
    predictions: Predictions,
    roots: Roots,
    columns: Callable[[StateMean, Observation], FloatArray],
) -> FloatArray:
    """Return columns (c, k) of every predicted state one below the other, whitened, without what was not measured."""
    blocks = []
    for mean in means:
        observation = predictions[mean.experiment].get(mean.state)
        if observation is not None:
            seen = mean.count > 0
            root = roots[mean.experiment, mean.state]
            raw = columns(mean, observation)[seen]
            blocks.append(solve_triangular(root, raw, lower=True, check_finite=False))
    return np.concatenate(blocks)
