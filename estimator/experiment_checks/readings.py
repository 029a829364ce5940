"""Quantities of an experiment that several checks judge by."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.experiment.holds import Box, FloatArray
from estimator.experiment.model import Experiment
from estimator.surfaces.reading import surface_bounds

SURELY = 5.0
"""Standard deviations: among ten thousand values of normal noise one in two hundred tables has one beyond."""


def body_box(experiment: Experiment) -> Box:
    """Return the phantom's bounding box, m."""
    phantom = experiment.phantom
    if phantom.surface is not None:
        try:
            (x0, y0, z0), (x1, y1, z1) = surface_bounds(phantom.surface, phantom.unit).tolist()
        except InputError:
            pass
        else:
            return Box((x0, y0, z0), (x1, y1, z1))
    x, y, z = (abs(edge) / 2 for edge in phantom.size_m)
    return Box((-x, -y, -z), (x, y, z))


def longest_edge(experiment: Experiment) -> float:
    """Return the longest edge of the phantom, m."""
    return max(abs(edge) for edge in experiment.phantom.size_m)


def travel(experiment: Experiment) -> FloatArray:
    """Return the motion of the gripper's origin since the first row, (n, 3), m."""
    return experiment.position - experiment.position[0]


def rotation_vectors(experiment: Experiment) -> FloatArray:
    """Return the turn of the gripper since the first row, (n, 3), rad; zero where no orientation is readable."""
    quaternion = experiment.quaternion_wxyz
    if np.any(np.linalg.norm(quaternion, axis=1) < 0.5):
        return np.zeros((len(quaternion), 3))
    rotation = Rotation.from_quat(quaternion, scalar_first=True)
    return np.asarray((rotation * rotation[0].inv()).as_rotvec())


def at_rest(experiment: Experiment) -> NDArray[np.bool_]:
    """Tell which of the first rows are before any motion: those up to the first that has surely moved.

    None is where the experiment begins under load.
    """
    if experiment.first_row == "under_load":
        return np.zeros(len(experiment.time), dtype=bool)
    sensor = experiment.sensor
    least = SURELY * max(sensor.position_std, 0.0) * np.sqrt(2) + 1e-4 * longest_edge(experiment)
    moved = np.linalg.norm(travel(experiment), axis=1) > least
    moved |= np.linalg.norm(rotation_vectors(experiment), axis=1) > np.radians(1.0)
    moved |= experiment.step > experiment.step[0]
    return np.asarray(np.cumsum(moved) == 0)


def measured_forces(experiment: Experiment) -> tuple[int, ...]:
    """Return the axes whose force was measured in more than the first row."""
    known = np.isfinite(experiment.wrench[1:, :3])
    return tuple(axis for axis in range(3) if known[:, axis].any())
