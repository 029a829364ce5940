"""Where things are, in millimetres: the gripped and the anchored tissue at rest and on the way."""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.experiment import Box, Experiment

FloatArray = NDArray[np.float64]

MM = 1e3
# Corners of a box in the order of :func:`corners_mm`, around each face.
BOX_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def farthest_row(experiment: Experiment) -> int:
    """Return the row at which the gripper is farthest from where it began."""
    return int(np.argmax(np.linalg.norm(experiment.position - experiment.position[0], axis=1)))


def extent_mm(points: FloatArray) -> FloatArray:
    """Return the lowest and the highest coordinates (2, 3) of points (n, 3) in metres."""
    return MM * np.stack([points.min(axis=0), points.max(axis=0)])


def within_mm(box: Box, extent: FloatArray) -> FloatArray:
    """Return the corners (2, 3) of the part of a box that lies within an extent (2, 3)."""
    return np.clip(MM * np.array([box.lower, box.upper]), extent[0], extent[1])


def corners_mm(box: FloatArray) -> FloatArray:
    """Return the eight corners (8, 3) of a box (2, 3)."""
    return np.array([[box[i, 0], box[j, 1], box[k, 2]] for i, j, k in product((0, 1), repeat=3)])


def moved_with_gripper_mm(points: FloatArray, experiment: Experiment, row: int) -> FloatArray:
    """Return where points (n, 3) of the gripped tissue at rest are at a row."""
    rotation = Rotation.from_quat(experiment.quaternion_wxyz[row], scalar_first=True)
    return MM * experiment.position[row] + rotation.apply(points - MM * np.array(experiment.grasp.centre))
