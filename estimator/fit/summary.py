"""From the last linearisation to the values, intervals and residuals that people read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.observation import Observation
from estimator.fit.gauss_newton import Iterate, MarginalStep
from estimator.fit.parameters import FitParameter
from estimator.fit.residuals import (
    channel_variance,
    channels_by,
    channels_by_position,
    measured_rows,
    predicted_channels,
)
from estimator.fit.result import Estimate, ExperimentFit, ParameterEstimate, Rmse
from estimator.forward.model import ForwardModel

FloatArray = NDArray[np.float64]

_Z95 = 1.959963984540054


@dataclass(frozen=True, eq=False)
class FitOutcome:
    """A finished fit.

    Attributes
    ----------
    values : final parameter values by name
    step : their change since ``predictions`` were made
    change : prediction on the finer mesh less that on the model's, for each (experiment, state), (6 + 3m,)
    last : the linearised problem, in internal variables
    bias_std : (p,) standard deviation of the bias that the discretisation leaves, in internal variables
    """

    experiments: tuple[Experiment, ...]
    model: ForwardModel
    parameters: tuple[FitParameter, ...]
    values: dict[str, float]
    step: dict[str, float]
    iterates: tuple[Iterate, ...]
    predictions: Sequence[Mapping[int, Observation]]
    change: Mapping[tuple[int, int], FloatArray]
    last: MarginalStep
    bias_std: FloatArray
    forward_solves: int


def summarise(outcome: FitOutcome, seconds: float) -> Estimate:
    """Return the estimate that a finished fit amounts to."""
    fits = tuple(_fit_of(outcome, number) for number in range(len(outcome.experiments)))
    deviations = [(measured_rows(f.experiment) - _predicted_rows(f)) for f in fits]
    noise_ratio = _noise_ratio(outcome)
    inflation = max(1.0, noise_ratio)
    covariance = outcome.last.covariance * inflation**2 + np.outer(outcome.bias_std, outcome.bias_std)
    estimates = [
        _interval(parameter, outcome.values[parameter.name], float(np.sqrt(covariance[n, n])))
        for n, parameter in enumerate(outcome.parameters)
    ]
    stacked = np.concatenate(deviations)
    return Estimate(
        youngs_modulus=estimates[0],
        poisson_ratio=estimates[1],
        correlation=float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])),
        rmse=Rmse(_rms(stacked[:, :3]), _rms(stacked[:, 3:6]), _rms(stacked[:, 6:])),
        noise_ratio=noise_ratio,
        inflation=inflation,
        iterates=outcome.iterates,
        forward_solves=outcome.forward_solves,
        seconds=seconds,
        mesh=outcome.model.problem.body.mesh,
        discretisation_force=max(float(np.abs(c[:3]).max()) for c in outcome.change.values()),
        fits=fits,
    )


def _noise_ratio(outcome: FitOutcome) -> float:
    """Return the root mean square of all residuals, tares and offsets taken out, in units of the stated noise.

    The misfit of the state means and the scatter of the rows about them add up to that of all rows.
    """
    squares, count = outcome.last.chi2_after, 0
    for experiment, schedule in zip(outcome.experiments, outcome.model.schedules, strict=True):
        rows = measured_rows(experiment) / np.sqrt(channel_variance(experiment))
        for state in range(len(schedule.poses)):
            of_state = rows[schedule.state_of_row == state]
            measured = np.isfinite(of_state).sum(axis=0)
            seen = of_state[:, measured > 0]
            squares += float(np.nansum((seen - np.nanmean(seen, axis=0)) ** 2))
            count += int(measured.sum())
    return float(np.sqrt(squares / (count - len(outcome.parameters))))


def _fit_of(outcome: FitOutcome, number: int) -> ExperimentFit:
    experiment, schedule = outcome.experiments[number], outcome.model.schedules[number]
    by_state, variance_by_state = [], []
    for state, rows_of_state in enumerate(schedule.rows_per_state):
        observation = outcome.predictions[number][state]
        moved = sum(
            (channels_by(observation, name) * change for name, change in outcome.step.items()),
            start=outcome.change[number, state],
        )
        by_state.append(predicted_channels(observation) + moved)
        position_variance = experiment.sensor.position_std**2 / rows_of_state
        from_position = position_variance * np.sum(channels_by_position(observation) ** 2, axis=1)
        variance_by_state.append(channel_variance(experiment) + from_position)
    rows = np.array(by_state)[schedule.state_of_row]
    std = np.sqrt(variance_by_state)[schedule.state_of_row]
    farthest = int(
        np.argmax([np.linalg.norm(p.position - schedule.poses[0].position) for p in schedule.poses])
    )
    return ExperimentFit(
        experiment,
        rows[:, :6],
        rows[:, 6:].reshape(experiment.fiducials.shape),
        outcome.model.deformed(number, farthest),
        std[:, :6],
        std[:, 6:].reshape(experiment.fiducials.shape),
    )


def _predicted_rows(fit: ExperimentFit) -> FloatArray:
    return np.hstack([fit.wrench, fit.fiducials.reshape(len(fit.wrench), -1)])


def _interval(parameter: FitParameter, value: float, internal_std: float) -> ParameterEstimate:
    """Return the interval that is symmetric in the internal variable, cut at the bounds."""
    internal = parameter.to_internal(value)
    ends = [parameter.from_internal(internal + sign * _Z95 * internal_std) for sign in (-1.0, 1.0)]
    ends = [min(max(end, parameter.lower), parameter.upper) for end in ends]
    return ParameterEstimate(value, internal_std * parameter.slope(value), (ends[0], ends[1]))


def _rms(values: FloatArray) -> float:
    measured = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(measured**2))) if len(measured) else float("nan")
