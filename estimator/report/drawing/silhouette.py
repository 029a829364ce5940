"""The outline of a body from above: the box of a block, the shadow's edge of a surface."""

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Box, PaintedPatch, Phantom
from estimator.report.drawing.scene import MM, around, from_above, rectangle
from estimator.report.drawing.view import View
from estimator.report.drawing.within import facing, skin_of
from estimator.surfaces.surface import Surface, directed_edges

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_FROM_ABOVE = View(-90.0, 90.0)
# How far beside the middle of a piece it is looked whether the body goes on there: a share of the body's diagonal.
_BESIDE = 1e-4
# Of an edge: where the edges of two folds cross, a part of each bounds the shadow.
_PARTS = 4


def extent_mm(phantom: Phantom) -> FloatArray:
    """Return the lower and the upper corner (2, 3) of a phantom's bounding box at rest, mm.

    Raises
    ------
    InputError
        The file of its surface cannot be read.
    """
    skin = skin_of(phantom)
    half = np.array(phantom.size_m) / 2
    return MM * (np.stack([-half, half]) if skin is None else skin.bounds)


def silhouette(phantom: Phantom) -> FloatArray:
    """Return the straight pieces (k, 2, 2), mm, that bound a phantom from above, the body to the left of each.

    Raises
    ------
    InputError
        The file of its surface cannot be read.
    """
    skin = skin_of(phantom)
    if skin is None:
        corners = rectangle(extent_mm(phantom))
        return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    return MM * shadow_edge(skin)


def held_from_above(box: Box, phantom: Phantom) -> FloatArray:
    """Return the outline (k, 2), mm, anticlockwise, of what a box or a painted patch holds of a phantom, from above.

    Of a surface it is the convex one around what lies in the box.

    Raises
    ------
    InputError
        The file of its surface cannot be read.
    """
    skin = skin_of(phantom)
    if skin is not None and not isinstance(box, PaintedPatch):
        ends = _within(box, skin.vertices[directed_edges(skin.triangles)]).reshape(-1, 3)
        if len(ends):
            return around(MM * ends[:, :2])
    return from_above(box, extent_mm(phantom))


def shadow_edge(surface: Surface) -> FloatArray:
    """Return the pieces (k, 2, 2), m, of the edges of a surface that bound its shadow from above.

    An edge between a triangle that looks up and one that looks down bounds the shadow where nothing else of the body
    lies beside it.
    """
    up = surface.triangles[facing(surface.vertices, surface.triangles, _FROM_ABOVE)]
    edges = directed_edges(up)
    key = edges @ [len(surface.vertices), 1]
    back = edges @ [1, len(surface.vertices)]
    rims = surface.vertices[edges[~np.isin(key, back)], :2]
    shares = np.linspace(0.0, 1.0, _PARTS + 1)[:, None]
    stops = rims[:, :1] + shares * (rims[:, 1:] - rims[:, :1])
    pieces = np.stack([stops[:, :-1], stops[:, 1:]], axis=2).reshape(-1, 2, 2)
    along = pieces[:, 1] - pieces[:, 0]
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    outward = along[:, ::-1] * [1.0, -1.0] / length
    beside = pieces.mean(axis=1) + _BESIDE * surface.diagonal_m * outward
    return np.asarray(pieces[~_covered(beside, surface.vertices[up, :2])])


def _within(box: Box, pieces: FloatArray) -> FloatArray:
    """Return the parts (j, 2, 3) of straight pieces (k, 2, 3) that lie in a box."""
    start, way = pieces[:, 0], pieces[:, 1] - pieces[:, 0]
    slope = np.where(way == 0.0, np.finfo(float).tiny, way)
    ends = np.sort([(np.array(one) - start) / slope for one in (box.lower, box.upper)], axis=0)
    enters, leaves = np.maximum(ends[0].max(axis=1), 0.0), np.minimum(ends[1].min(axis=1), 1.0)
    meets = enters <= leaves
    shares = np.stack([enters, leaves], axis=1)[meets, :, None]
    return np.asarray(start[meets, None] + shares * way[meets, None])


def _covered(places: FloatArray, triangles: FloatArray) -> BoolArray:
    """Tell which places (k, 2) lie in any of the triangles (t, 3, 2), which turn anticlockwise."""
    inside = np.ones((len(places), len(triangles)), dtype=bool)
    for corner in range(3):
        start, end = triangles[:, corner], triangles[:, (corner + 1) % 3]
        way, away = end - start, places[:, None] - start
        inside &= way[:, 0] * away[..., 1] - way[:, 1] * away[..., 0] >= 0
    return np.asarray(inside.any(axis=1))
