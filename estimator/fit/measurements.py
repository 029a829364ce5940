"""What was measured at each state of an experiment, and how far single rows are from what is expected there.

All rows of one state have one prediction, so their mean per channel carries all that they say about it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.equilibrium.observation import Observation
from estimator.forward.schedule import PoseSchedule
from estimator.inference.channels import channel_variance, channels_by_pose, measured_rows

FloatArray = NDArray[np.float64]


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
    pose_variance : (6,) of the mean pose of the gripper, m² and rad²
    """

    experiment: int
    state: int
    mean: FloatArray
    count: FloatArray
    variance: FloatArray
    pose_variance: FloatArray


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
            pose_std = experiment.sensor.pose_std
            means.append(mean_of_rows(number, state, rows[of_state], weight[of_state], variance, pose_std))
    return means


def mean_of_rows(
    experiment: int,
    state: int,
    rows: FloatArray,
    weights: FloatArray,
    variance: FloatArray,
    pose_std: FloatArray,
) -> StateMean:
    """Average the rows (n, c) of one state with their weights, zero where nothing was measured."""
    count = weights.sum(axis=0)
    total = np.nansum(weights * rows, axis=0)
    mean = np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
    return StateMean(experiment, state, mean, count, variance, pose_std**2 / len(rows))


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

    That is the sensors' noise, and what the error of the mean reported pose of so many rows adds.
    """
    from_pose = channels_by_pose(observation) ** 2 @ experiment.sensor.pose_std**2 / rows
    return np.asarray(np.sqrt(channel_variance(experiment) + from_pose))
