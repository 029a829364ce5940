"""Triangles without area, and corners that lie on the edge of another triangle.

Both come of programs that cut a straight edge on one of its sides only. A flat triangle is removed by turning the edge
that its third corner lies on (M. Botsch & L. Kobbelt, "A robust procedure to eliminate degenerate faces from triangle
meshes", VMV 2001): dropped, it would leave a hole without width. Such a hole is closed by splitting the triangle
whose edge it is.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimator.surfaces.edges import edges_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# A triangle of less than this share of longest edge of the surface times its own longest edge is flat.
_FLAT = 1e-9


def flat_triangles(vertices: FloatArray, triangles: IntArray, longest: float) -> BoolArray:
    """Tell which triangles (t, 3) have no area, on a surface so long."""
    corners = vertices[triangles]
    edge = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2 <= _FLAT * longest * edge)


def without_flat(vertices: FloatArray, triangles: IntArray, longest: float) -> tuple[IntArray, int, int]:
    """Return the triangles with the flat ones turned into their neighbours, how many these were, and how many are left.

    Those remain flat whose third corner lies on an edge of none or of several triangles.
    """
    begun = int(np.count_nonzero(flat_triangles(vertices, triangles, longest)))
    left = begun
    while left:
        triangles, turned = _turned(vertices, triangles, flat_triangles(vertices, triangles, longest))
        now = int(np.count_nonzero(flat_triangles(vertices, triangles, longest)))
        if not turned or now >= left:
            break
        left = now
    return triangles, begun - left, left


def _turned(vertices: FloatArray, triangles: IntArray, flat: BoolArray) -> tuple[IntArray, bool]:
    """Turn the long edge of every flat triangle whose neighbour there is not flat, no triangle twice."""
    edges, result = edges_of(triangles), triangles.copy()
    touched = set[int]()
    for number in np.flatnonzero(flat).tolist():
        corners = triangles[number]
        lengths = np.linalg.norm(vertices[corners] - vertices[np.roll(corners, -1)], axis=1)
        a, b, tip = np.roll(corners, -int(np.argmax(lengths))).tolist()
        edge = edges.number(a, b)
        others = [] if edge is None else [one for one in edges.triangles_at(edge).tolist() if one != number]
        if len(others) != 1 or flat[others[0]] or {number, others[0]} & touched:
            continue
        (other,) = others
        if tip in triangles[other]:
            continue
        result[number] = np.where(triangles[other] == a, tip, triangles[other])
        result[other] = np.where(triangles[other] == b, tip, triangles[other])
        touched |= {number, other}
    return result, bool(touched)


def with_corners_joined(vertices: FloatArray, triangles: IntArray, tolerance: float) -> tuple[IntArray, int]:
    """Split triangles at the corners of others that lie on their open edges; return them, and how many there were."""
    edges = edges_of(triangles)
    opened = np.flatnonzero(edges.uses == 1)
    ends = edges.ends(opened)
    if not len(ends):
        return triangles, 0
    corners = np.unique(ends)
    split, parts = np.zeros(len(triangles), dtype=bool), list[tuple[int, int, int]]()
    for edge, (a, b) in zip(opened.tolist(), ends.tolist(), strict=True):
        between = _on_edge(vertices, corners, a, b, tolerance)
        number = int(edges.triangles_at(edge)[0])
        if not len(between) or split[number]:
            continue
        split[number] = True
        tip_at = int(np.flatnonzero((triangles[number] != a) & (triangles[number] != b))[0])
        tip, first, _ = np.roll(triangles[number], -tip_at).tolist()
        way = [a, *between.tolist(), b] if first == a else [b, *between[::-1].tolist(), a]
        parts += [(tip, one, other) for one, other in pairwise(way)]
    joined = np.concatenate([triangles[~split], np.array(parts, dtype=np.int64).reshape(-1, 3)])
    return joined, int(np.count_nonzero(split))


def _on_edge(vertices: FloatArray, corners: IntArray, a: int, b: int, tolerance: float) -> IntArray:
    """Return those of the corners that lie on the edge from a to b, in that order."""
    along = vertices[b] - vertices[a]
    length = float(np.linalg.norm(along))
    away = vertices[corners] - vertices[a]
    share = away @ along / length**2
    off = np.linalg.norm(away - share[:, None] * along, axis=1)
    found = (off <= tolerance) & (share * length > tolerance) & ((1 - share) * length > tolerance)
    return corners[found][np.argsort(share[found])]
