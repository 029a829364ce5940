"""Wrench and fiducials of an experiment or of a prediction side by side: 6 + 3m channels."""

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.equilibrium.observation import Observation

FloatArray = NDArray[np.float64]


def side_by_side(wrench: FloatArray, fiducials: FloatArray) -> FloatArray:
    """Return a wrench (n, 6) and fiducials (n, m, 3) side by side, (n, 6 + 3m)."""
    return np.hstack([wrench, fiducials.reshape(len(wrench), -1)])


def measured_rows(experiment: Experiment) -> FloatArray:
    """Return what an experiment measured, (n, 6 + 3m); NaN where nothing was."""
    return side_by_side(experiment.wrench, experiment.fiducials)


def channel_variance(experiment: Experiment) -> FloatArray:
    """Return the stated variance of each channel of one row, (6 + 3m,)."""
    sensor, beads = experiment.sensor, len(experiment.fiducials_rest)
    return np.square(np.concatenate([sensor.wrench_std, np.tile(sensor.bead_std, beads)]))


def predicted_channels(observation: Observation) -> FloatArray:
    """Return a prediction in the order of :func:`measured_rows`, (6 + 3m,)."""
    return side_by_side(observation.wrench[None], observation.fiducials[None])[0]


def channels_by(observation: Observation, name: str) -> FloatArray:
    """Return the derivative of :func:`predicted_channels` by a material parameter."""
    return np.concatenate([observation.wrench_by[name], observation.fiducials_by[name].reshape(-1)])


def channels_by_pose(observation: Observation) -> FloatArray:
    """Return the derivative of :func:`predicted_channels` by the gripper's translation and rotation, (6 + 3m, 6)."""
    return np.concatenate([observation.wrench_by_pose, observation.fiducials_by_pose.reshape(-1, 6)])


def of_wrench(channels: int) -> NDArray[np.bool_]:
    """Tell which of so many channels (c,) are those of the wrench."""
    return np.arange(channels) < 6


def offsets(sizes: FloatArray) -> FloatArray:
    """Return an offset of each channel that has one as a column (c, k), of ``sizes`` (c,)."""
    return np.asarray(np.diag(sizes)[:, np.flatnonzero(sizes)])
