"""Residuals of single rows in units of their noise: what a robust loss judges them by."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.equilibrium.observation import Observation
from estimator.fit.residuals import channel_variance, channels_by_position, measured_rows
from estimator.forward.schedule import PoseSchedule

FloatArray = NDArray[np.float64]


def row_residuals(
    experiments: Sequence[Experiment],
    schedules: Sequence[PoseSchedule],
    expected: Mapping[tuple[int, int], FloatArray],
    deviations: Mapping[tuple[int, int], FloatArray],
) -> list[FloatArray]:
    """Return the residuals (n, c) of each experiment's rows; NaN where nothing was measured.

    Parameters
    ----------
    expected : for each (experiment, state) the channels (c,) with all nuisances at their best
    deviations : of a row about them, (c,), from :func:`row_deviation`
    """
    residuals = []
    for number, (experiment, schedule) in enumerate(zip(experiments, schedules, strict=True)):
        states = range(len(schedule.poses))
        about = np.array([expected[number, state] for state in states])[schedule.state_of_row]
        deviation = np.array([deviations[number, state] for state in states])[schedule.state_of_row]
        residuals.append((measured_rows(experiment) - about) / deviation)
    return residuals


def row_deviation(experiment: Experiment, observation: Observation, rows: int) -> FloatArray:
    """Return the standard deviation (c,) of one row's channels about the prediction at the mean pose of its state.

    That is the sensors' noise, and what the error of the mean reported position of so many rows adds.
    """
    position_variance = experiment.sensor.position_std**2 / rows
    from_position = position_variance * np.sum(channels_by_position(observation) ** 2, axis=1)
    return np.asarray(np.sqrt(channel_variance(experiment) + from_position))
