"""Imprints the outlines of boxes and patches into a surface: afterwards no triangle lies half in one.

Triangles are split where a face of the box, or the rim of the patch, crosses their edges. An edge is split once for
all its triangles, so the surface stays closed.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Box
from estimator.surfaces.surface import Surface, directed_edges, used_vertices

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# Neighbouring triangles that meet at a sharper angle than this form an edge of the body.
_CREASE_COSINE = np.cos(np.radians(30.0))
# A vertex this close to a plane, as a share of the bounding box's diagonal, lies on it: files in single precision.
_ON_PLANE = 1e-6
# One whose level is this share of the highest lies on the rim of its patch.
_ON_RIM = 1e-6


def imprint_box(surface: Surface, box: Box, tolerance_m: float) -> tuple[Surface, IntArray]:
    """Split the triangles that a box's faces cross.

    A face of the box that passes an edge of the body within ``tolerance_m`` means that edge: its vertices count as
    lying on the face, so that no sliver is cut off beside it.

    Returns
    -------
    surface : with the new triangles
    parent : (t,) int64, the triangle of the given surface that each one is a part of
    """
    parent = np.arange(len(surface.triangles))
    for axis in range(3):
        for place in (box.lower[axis], box.upper[axis]):
            surface, origin = _split_by_plane(surface, box, axis, place, tolerance_m)
            parent = parent[origin]
    return surface, parent


def triangles_in_box(surface: Surface, box: Box) -> BoolArray:
    """Tell for every triangle (t,) of a surface, into which the box is imprinted, whether it lies in the box."""
    centres, margin = surface.corners.mean(axis=1), _ON_PLANE * surface.diagonal_m
    lower, upper = np.array(box.lower) - margin, np.array(box.upper) + margin
    return np.asarray(((centres >= lower) & (centres <= upper)).all(axis=1))


def imprint_levels(surface: Surface, levels: FloatArray) -> tuple[Surface, BoolArray]:
    """Split the triangles that the rims of patches cross.

    Parameters
    ----------
    surface : Surface
    levels : (n, k) float64, for each patch a number at every vertex, linear between, that is zero on its rim

    Returns
    -------
    surface : with the new triangles
    patches : (t, k) bool, whether they lie in each patch, where its number is not below zero
    """
    for patch in range(levels.shape[1]):
        side = _sides(levels)[:, patch]
        edges = np.unique(np.sort(directed_edges(surface.triangles), axis=1), axis=0)
        edges = edges[side[edges].prod(axis=1) < 0]
        a, b = levels[edges].transpose(1, 0, 2)
        share = a[:, patch, None] / (a - b)[:, patch, None]
        between = a + share * (b - a)
        between[:, patch] = 0.0
        p, q = surface.vertices[edges].transpose(1, 0, 2)
        surface, _ = _split_edges(surface, edges, p + share * (q - p))
        levels = np.vstack([levels, between])
    return surface, np.asarray((_sides(levels)[surface.triangles] >= 0).all(axis=1))


def _sides(levels: FloatArray) -> FloatArray:
    """Return the signs (n, k) of levels, 0 on their rims."""
    size = np.abs(levels)
    return np.where(size <= _ON_RIM * size.max(axis=0, initial=0.0), 0.0, np.sign(levels))


def rim(surface: Surface, patch: BoolArray) -> IntArray:
    """Return the edges (m, 2) between the triangles (t,) of a patch and the others, in the patch's rotation."""
    directed = directed_edges(surface.triangles[patch])
    _, number, uses = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
    return directed[uses[number.ravel()] == 1]


def _split_by_plane(
    surface: Surface, box: Box, axis: int, place: float, tolerance_m: float
) -> tuple[Surface, IntArray]:
    offset = surface.vertices[:, axis] - place
    side = np.sign(np.where(np.abs(offset) <= _ON_PLANE * surface.diagonal_m, 0.0, offset))
    on_crease = used_vertices(crease_edges(surface), len(offset))
    side[on_crease[np.abs(offset[on_crease]) <= tolerance_m]] = 0
    corners = surface.corners
    near = np.all((corners.max(axis=1) >= box.lower) & (corners.min(axis=1) <= box.upper), axis=1)
    edges = np.unique(np.sort(directed_edges(surface.triangles[near]), axis=1), axis=0)
    edges = edges[side[edges].prod(axis=1) < 0]
    a, b = surface.vertices[edges].transpose(1, 0, 2)
    share = (place - a[:, axis]) / (b - a)[:, axis]
    points = a + share[:, None] * (b - a)
    points[:, axis] = place
    return _split_edges(surface, edges, points)


def _split_edges(surface: Surface, edges: IntArray, points: FloatArray) -> tuple[Surface, IntArray]:
    """Put ``points`` (m, 3) on ``edges`` (m, 2); a triangle has at most two of them, since a plane crosses no more."""
    count = len(surface.vertices)
    keys = edges[:, 0] * count + edges[:, 1]
    directed = np.sort(directed_edges(surface.triangles), axis=1)
    key = directed[:, 0] * count + directed[:, 1]
    place = np.minimum(np.searchsorted(keys, key), max(len(keys) - 1, 0))
    split = keys[place] == key if len(keys) else np.zeros(len(key), dtype=bool)
    middle = np.where(split, count + place, -1).reshape(-1, 3)
    number = np.count_nonzero(middle >= 0, axis=1)
    # Rotate each triangle so that its first edge is split, and its second is not or is split as well.
    whole = np.arange(len(middle))
    first = np.where(number == 2, (np.argmin(middle, axis=1) + 1) % 3, np.argmax(middle, axis=1))
    turn = (first[:, None] + np.arange(3)) % 3
    (v0, v1, v2), (m0, m1, _) = (np.take_along_axis(x, turn, axis=1).T for x in (surface.triangles, middle))
    once, twice = number == 1, number == 2
    pieces = [
        (whole[number == 0], surface.triangles[number == 0]),
        (whole[once], np.stack([v0, m0, v2], axis=1)[once]),
        (whole[once], np.stack([m0, v1, v2], axis=1)[once]),
        (whole[twice], np.stack([m0, v1, m1], axis=1)[twice]),
        (whole[twice], np.stack([v0, m0, m1], axis=1)[twice]),
        (whole[twice], np.stack([v0, m1, v2], axis=1)[twice]),
    ]
    origin = np.concatenate([piece[0] for piece in pieces])
    triangles = np.concatenate([piece[1] for piece in pieces])
    order = np.argsort(origin, kind="stable")
    return Surface(np.vstack([surface.vertices, points]), triangles[order]), origin[order]


def crease_edges(surface: Surface) -> IntArray:
    """Return the edges (m, 2) of the body, where its triangles meet at an angle."""
    normals = surface.area_vectors / surface.areas[:, None]
    directed = np.sort(directed_edges(surface.triangles), axis=1)
    first, second = np.lexsort(directed.T).reshape(-1, 2).T
    sharp = np.einsum("ex,ex->e", normals[first // 3], normals[second // 3]) < _CREASE_COSINE
    return directed[first[sharp]]
