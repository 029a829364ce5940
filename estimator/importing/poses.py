"""Poses of the gripper, relative to its first: from columns, or from points that are fixed to it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.importing.table import FloatArray

_LEAST_FOR_A_TURN = 3
_ALMOST_A_LINE = 1e-6


def pose_of_points(points: FloatArray, where: str) -> tuple[FloatArray, Rotation, NDArray[np.bool_]]:
    """Return how points fixed to a body have moved since the first row.

    Three or more that are not in one line tell its turn; of fewer, only the middle is followed.

    Parameters
    ----------
    points : (n, k, 3), m

    Returns
    -------
    places : (n, 3) of their middle
    turns : n rotations, of the body's axes against those of the first row
    missing : (n,) whether a row has no pose

    Raises
    ------
    InputError
        They are not all seen in the first row.
    """
    if not np.isfinite(points[0]).all():
        raise InputError(
            f"{where}: not every point of the gripper is seen in the first row; begin at another row"
        )
    seen = np.asarray(np.isfinite(points).all(axis=(1, 2)))
    middle = points.mean(axis=1)
    first = points[0] - middle[0]
    spread = np.linalg.svd(first, compute_uv=False)
    turns = Rotation.identity(len(points))
    if len(first) >= _LEAST_FOR_A_TURN and spread[1] > _ALMOST_A_LINE * spread[0]:
        each = [
            Rotation.align_vectors(now - now.mean(axis=0), first)[0] if known else Rotation.identity()
            for now, known in zip(points, seen, strict=True)
        ]
        turns = Rotation.concatenate(each)
    return middle, turns, ~seen


def relative_turns(turns: Rotation) -> Rotation:
    """Return rotations against the first of them."""
    return turns * turns[0].inv()


def along_tissue_axes(turns: Rotation, R_tissue_source: FloatArray) -> Rotation:
    """Return rotations that are known in the source's axes in the tissue's."""
    return Rotation.from_rotvec(turns.as_rotvec() @ R_tissue_source.T)
