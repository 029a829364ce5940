"""Splits polygons into triangles without moving, adding or losing a corner.

Ears are cut off in the plane that fits the polygon best (G. H. Meisters, "Polygons have ears", Amer. Math. Monthly 82,
1975), the best shaped one first. A corner on a straight edge is no ear, so that it becomes the tip of no flat
triangle, and stays, so that no hole opens beside it.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimator.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_MOST_CORNERS = 20_000
# Twice an area below this share of the squared edges is none: corners in single precision.
_STRAIGHT = 1e-6


def triangulate(vertices: FloatArray, nodes: IntArray, ends: IntArray, source: str) -> IntArray:
    """Return the triangles (t, 3) of polygons, in their order and sense of rotation.

    Parameters
    ----------
    vertices : (n, 3) float64
    nodes : (k,) int64, corners of the polygons, three or more each
    ends : (p,) int64, place in ``nodes`` behind the last corner of each
    source : file, as messages name it

    Raises
    ------
    InputError
        A polygon has too many corners.
    """
    starts = np.concatenate([[0], ends[:-1]]).astype(np.int64)
    corners = ends - starts
    if corners.max(initial=3) > _MOST_CORNERS:
        raise InputError(
            f"{source}: a face has {corners.max()} corners, and at most {_MOST_CORNERS} are split; split it into "
            "triangles where the surface was made"
        )
    places = np.concatenate([[0], np.cumsum(corners - 2)])
    triangles = np.empty((places[-1], 3), dtype=np.int64)
    three, four = corners == 3, corners == 4
    triangles[places[:-1][three]] = nodes[starts[three, None] + np.arange(3)]
    halves = _halves(vertices, nodes[starts[four, None] + np.arange(4)])
    triangles[places[:-1][four, None] + np.arange(2)] = halves
    for polygon in np.flatnonzero(~three & ~four):
        ring = nodes[starts[polygon] : ends[polygon]]
        cut = _cut_ears(*_flattened(vertices[ring]))
        triangles[places[polygon] : places[polygon + 1]] = ring[cut]
    return triangles


def _halves(vertices: FloatArray, rings: IntArray) -> IntArray:
    """Return the two triangles (q, 2, 3) of quadrilaterals (q, 4), cut so that the worse one is as good as can be."""
    a, b, c, d = np.moveaxis(vertices[rings], 1, 0)
    normal = np.cross(c - a, d - b)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    along_ac = np.minimum(_quality(a, b, c, normal), _quality(a, c, d, normal))
    along_bd = np.minimum(_quality(a, b, d, normal), _quality(b, c, d, normal))
    cuts = np.where((along_ac >= along_bd)[:, None, None], [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]])
    return np.take_along_axis(rings[:, None, :], cuts.reshape(-1, 2, 3), axis=2)


def _quality(a: FloatArray, b: FloatArray, c: FloatArray, normal: FloatArray) -> FloatArray:
    """Return twice the areas (n,) of triangles over their squared edges; negative where they are turned over."""
    doubled = np.einsum("nx,nx->n", np.cross(b - a, c - a), normal)
    edges = ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1)
    return doubled / np.maximum(edges, np.finfo(float).tiny)


def _flattened(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a ring of points (n, 3) in its plane, (n,) and (n,), anticlockwise; the normal by M. E. Newell."""
    centred = points - points.mean(axis=0)
    normal = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    length = np.linalg.norm(normal)
    if length == 0.0:
        return np.zeros(len(points)), np.zeros(len(points))
    normal /= length
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return centred @ first, centred @ np.cross(normal, first)


@njit(cache=True)
def _cut_ears(x: FloatArray, y: FloatArray) -> IntArray:
    """Return the triangles (n - 2, 3) of a ring of points."""
    count = len(x)
    before, after = np.arange(-1, count - 1), np.arange(1, count + 1)
    before[0], after[-1] = count - 1, 0
    worth = np.empty(count)
    for i in range(count):
        worth[i] = _worth(x, y, before, after, i)
    triangles = np.empty((count - 2, 3), np.int64)
    for t in range(count - 2):
        ear = np.argmax(worth)
        a, c = before[ear], after[ear]
        triangles[t, 0], triangles[t, 1], triangles[t, 2] = a, ear, c
        after[a], before[c] = c, a
        worth[ear] = -np.inf
        worth[a] = _worth(x, y, before, after, a)
        worth[c] = _worth(x, y, before, after, c)
    return triangles


@njit(cache=True)
def _worth(x: FloatArray, y: FloatArray, before: IntArray, after: IntArray, tip: int) -> float:
    """Return how good an ear is: twice its area over its squared edges; below zero where it is none."""
    a, c = before[tip], after[tip]
    doubled = _doubled_area(x, y, a, tip, c)
    edges = (
        (x[tip] - x[a]) ** 2 + (x[c] - x[tip]) ** 2 + (x[a] - x[c]) ** 2
        + (y[tip] - y[a]) ** 2 + (y[c] - y[tip]) ** 2 + (y[a] - y[c]) ** 2
    )  # fmt: skip
    if doubled <= _STRAIGHT * edges:
        return -3.0 if edges == 0.0 else -2.0 + doubled / edges
    other = after[c]
    while other != a:
        at_corner = (
            (x[other] == x[a] and y[other] == y[a])
            or (x[other] == x[tip] and y[other] == y[tip])
            or (x[other] == x[c] and y[other] == y[c])
        )
        least = min(
            _doubled_area(x, y, a, tip, other),
            _doubled_area(x, y, tip, c, other),
            _doubled_area(x, y, c, a, other),
        )
        if least >= -_STRAIGHT * edges and not at_corner:
            return -1.0
        other = after[other]
    return doubled / edges


@njit(cache=True)
def _doubled_area(x: FloatArray, y: FloatArray, a: int, b: int, c: int) -> float:
    return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])
