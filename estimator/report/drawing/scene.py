"""Where the tissue that is held lies, in millimetres, at rest and on the way."""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from estimator.experiment import Box, Experiment, PaintedPatch

FloatArray = NDArray[np.float64]

MM = 1e3
_GRASP_PIECES = (8, 8, 8)
_ON_THE_FACE_M = 1e-4


def farthest_row(experiment: Experiment) -> int:
    """Return the row at which the gripper is farthest from where it began."""
    return int(np.argmax(np.linalg.norm(experiment.position - experiment.position[0], axis=1)))


def within_mm(box: Box, extent: FloatArray) -> FloatArray:
    """Return the corners (2, 3) of the part of a box that lies within an extent (2, 3)."""
    return np.clip(MM * np.array([box.lower, box.upper]), extent[0], extent[1])


def from_above(box: Box, extent: FloatArray) -> FloatArray:
    """Return the outline (k, 2) from above, anticlockwise, of the part of a box within an extent (2, 3).

    Of a painted patch it is the convex one around its corners.
    """
    if isinstance(box, PaintedPatch):
        return around(MM * box.corners[:, :2])
    return rectangle(within_mm(box, extent))


def rectangle(box: FloatArray) -> FloatArray:
    """Return the outline (4, 2) of a box (2, 3) from above, anticlockwise."""
    (x0, y0), (x1, y1) = box[:, :2]
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def around(points: FloatArray) -> FloatArray:
    """Return the convex outline (k, 2) of points (n, 2), anticlockwise; that of their bounding box if it is flat."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return rectangle(np.stack([points.min(axis=0), points.max(axis=0)]))


def held_pieces(box: Box, points_m: FloatArray, pieces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which pieces (f, k) of a body's skin, with corners of (n, 3) m at rest, a box or a patch holds."""
    if isinstance(box, PaintedPatch):
        middles = points_m[pieces].mean(axis=1)
        size = np.ptp(points_m[pieces], axis=1).max(axis=1)
        # what lies behind the patch is nearest to it, too: the wall of a cavity
        return np.asarray(box.contains(middles) & (box.distance(middles) <= size + box.spacing))
    lower, upper = np.array(box.lower) - _ON_THE_FACE_M, np.array(box.upper) + _ON_THE_FACE_M
    inside = np.all((points_m > lower) & (points_m < upper), axis=1)
    return np.asarray(inside[pieces].all(axis=1))


def box_surface(box: FloatArray, pieces: tuple[int, int, int]) -> FloatArray:
    """Return the faces of a box (2, 3) as quadrilaterals (f, 4, 3), so many along x, y and z, anticlockwise outside."""
    steps = [np.linspace(0.0, 1.0, count + 1) for count in pieces]
    quads = []
    for axis, side in product(range(3), (0, 1)):
        # One direction in the face, then the other, turn anticlockwise about the outward normal.
        first, second = ((axis + 1) % 3, (axis + 2) % 3)[:: 1 if side else -1]
        for i, j in product(range(pieces[first]), range(pieces[second])):
            share = np.empty((4, 3))
            share[:, axis] = side
            share[:, first] = steps[first][[i, i + 1, i + 1, i]]
            share[:, second] = steps[second][[j, j, j + 1, j + 1]]
            quads.append(box[0] + share * (box[1] - box[0]))
    return np.array(quads)


def box_edges(box: FloatArray) -> FloatArray:
    """Return the twelve edges (12, 2, 3) of a box (2, 3)."""
    corners = list(product((0, 1), repeat=3))
    pairs = [(a, b) for a, b in product(corners, repeat=2) if a < b and np.abs(np.subtract(a, b)).sum() == 1]
    return box[0] + np.array(pairs) * (box[1] - box[0])


def gripped_surface(experiment: Experiment, extent: FloatArray, row: int) -> FloatArray:
    """Return where the outer faces of the gripped tissue are at a row, as quadrilaterals (f, 4, 3).

    A painted patch holds no tissue but its own surface: none.

    Parameters
    ----------
    extent : (2, 3) of the body at rest; faces of the grasp within it are not outer ones
    """
    if isinstance(experiment.grasp.box, PaintedPatch):
        return np.zeros((0, 4, 3))
    quads = box_surface(within_mm(experiment.grasp.box, extent), _GRASP_PIECES)
    quads = quads[((quads == extent[0]) | (quads == extent[1])).all(axis=1).any(axis=1)]
    turn = Rotation.from_quat(experiment.quaternion_wxyz[row], scalar_first=True).as_matrix()
    return MM * experiment.position[row] + (quads - MM * np.array(experiment.grasp.centre)) @ turn.T
