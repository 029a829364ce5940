"""Where a body that nothing keeps from drifting is pinned, so that its equilibrium is one and not many.

Between smooth plates nothing pushes a body aside. Three pins that stop a drift in two directions and a turn, and no
more, are statically determinate: in equilibrium they bear nothing, and only tell which of all the places where the body
could be is meant.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# What is left of a motion, relative to the largest, below which something prevents it.
_PREVENTED = 1e-6
# What the share by which a place lies aside counts against its lever.
_ASIDE = 4.0


def pinned(points: FloatArray, held: BoolArray) -> BoolArray:
    """Return the degrees of freedom (n, 3) to pin, as few as keep a body from moving as a whole; mostly none.

    Parameters
    ----------
    points : (n, 3), m
    held : (n, 3) bool, which of them are held already

    Notes
    -----
    The tissue in the middle of what is held stays where it is; a turn about it is stopped far away, at a place that
    does not move that way when the body grows wider.
    """
    pins = np.zeros_like(held)
    middle = points[held.any(axis=1)].mean(axis=0)
    scale = float(np.ptp(points, axis=0).max())
    nearest = int(np.argmin(np.linalg.norm(points - middle, axis=1)))
    away = (points - points[nearest]) / scale
    prevented = _motions(away)
    loose = _left(prevented[held])
    # First what a pin in the middle stops, then the turns about it.
    for candidates in (np.array([nearest]), np.arange(len(points))):
        while len(loose):
            strength = np.linalg.norm(prevented[candidates] @ loose.T, axis=2)
            if not strength.max() > _PREVENTED:
                break
            aside = _ASIDE * np.abs(away[candidates])
            score = np.where(strength > _PREVENTED, strength - aside, -np.inf)
            node, axis = np.unravel_index(int(np.argmax(score)), score.shape)
            pins[candidates[node], axis] = True
            loose = _left(np.concatenate([prevented[held], prevented[pins]]))
    return pins


def _motions(points: FloatArray) -> FloatArray:
    """Return the rigid motion (n, 3, 6) that holding a point (n, 3) along each axis prevents."""
    units = np.broadcast_to(np.eye(3), (len(points), 3, 3))
    return np.concatenate([units, np.cross(points[:, None], units)], axis=2)


def _left(prevented: FloatArray) -> FloatArray:
    """Return an orthonormal basis (k, 6) of the motions that are left."""
    size, motions = np.linalg.eigh(prevented.T @ prevented)
    return motions[:, size <= _PREVENTED**2 * max(float(size[-1]), 1.0)].T
