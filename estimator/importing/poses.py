"""Poses of the gripper, relative to its first: from columns, or from points that are fixed to it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.importing.mapping import ROTATION_VECTOR
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


def turns_of_angles(angles: FloatArray, form: str) -> Rotation:
    """Return the turns of angles (n, 3) about x, y and z, rad: a rotation vector, or one after the other."""
    if form == ROTATION_VECTOR:
        return Rotation.from_rotvec(angles)
    return Rotation.from_euler(form, angles[:, ["xyz".index(axis) for axis in form.lower()]])


def quaternions_between(own: FloatArray, quaternions: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return orientations at the wanted times by the shorter way between those beside them; NaN beyond the ends.

    A quaternion and its negative are one orientation, and files go from one to the other between two rows.

    Parameters
    ----------
    own : (k,) times, s
    quaternions : (k, 4), NaN where there is none
    wanted : (n,) times, s

    Examples
    --------
    >>> half = quaternions_between(np.array([0.0, 1.0]), np.array([[1.0, 0, 0, 0], [-1.0, 0, 0, 0]]), np.array([0.5]))
    >>> np.abs(half).tolist()
    [[1.0, 0.0, 0.0, 0.0]]
    """
    known = np.flatnonzero(np.isfinite(quaternions).all(axis=1) & np.isfinite(own))
    known = known[np.argsort(own[known], kind="stable")]
    if len(known) < 2:
        return np.full((len(wanted), 4), np.nan)
    kept = quaternions[known]
    turned = np.sum(kept[1:] * kept[:-1], axis=1) < 0
    kept = kept * np.concatenate([[1.0], np.where(np.cumsum(turned) % 2, -1.0, 1.0)])[:, None]
    read = [np.interp(wanted, own[known], one, left=np.nan, right=np.nan) for one in kept.T]
    found = np.stack(read, axis=1)
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def relative_turns(turns: Rotation) -> Rotation:
    """Return rotations against the first of them."""
    return turns * turns[0].inv()


def along_tissue_axes(turns: Rotation, R_tissue_source: FloatArray) -> Rotation:
    """Return rotations that are known in the source's axes in the tissue's."""
    return Rotation.from_rotvec(turns.as_rotvec() @ R_tissue_source.T)
