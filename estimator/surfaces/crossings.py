"""Where a surface crosses itself."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def crossings(surface: Surface) -> FloatArray:
    """Return the places (c, 3), m, where an edge of a triangle goes through another that shares no vertex with it."""
    corners = surface.corners
    order = np.argsort(corners[:, :, 0].min(axis=1))
    pairs = _pairs(corners[order], surface.triangles[order])
    return _through(corners[order], pairs)


@njit(cache=True)
def _pairs(corners: FloatArray, triangles: IntArray) -> IntArray:
    """Return the pairs (m, 2) of triangles, sorted by their lowest x, whose boxes overlap and that share no vertex."""
    found = []
    for i in range(len(corners)):
        for j in range(i + 1, len(corners)):
            if corners[j, :, 0].min() > corners[i, :, 0].max():
                break
            apart = False
            for x in range(1, 3):
                apart |= corners[j, :, x].min() > corners[i, :, x].max()
                apart |= corners[i, :, x].min() > corners[j, :, x].max()
            if apart:
                continue
            shared = False
            for a in triangles[i]:
                for b in triangles[j]:
                    shared |= a == b
            if not shared:
                found.append((i, j))
    pairs = np.empty((len(found), 2), np.int64)
    for place in range(len(found)):
        pairs[place, 0], pairs[place, 1] = found[place]
    return pairs


def _through(corners: FloatArray, pairs: IntArray) -> FloatArray:
    """Return where the edges of either triangle of each pair go through the other (T. Möller & B. Trumbore, 1997)."""
    places = [np.empty((0, 3))]
    for one, other in (pairs.T, pairs[:, ::-1].T):
        a, b, c = np.moveaxis(corners[other], 1, 0)
        for side in range(3):
            start = corners[one, side]
            along = corners[one, (side + 1) % 3] - start
            height = np.cross(along, c - a)
            scale = np.einsum("px,px->p", height, b - a)
            with np.errstate(divide="ignore", invalid="ignore"):
                u = np.einsum("px,px->p", start - a, height) / scale
                turn = np.cross(start - a, b - a)
                v = np.einsum("px,px->p", along, turn) / scale
                t = np.einsum("px,px->p", c - a, turn) / scale
                through = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)
            places.append(start[through] + t[through, None] * along[through])
    return np.concatenate(places)
