"""Where a painted patch of a surface ends: along a smooth line, not along triangles.

A painting has a number at points, and what of a rim is shorter than twice their distance is no shape of it but their
steps. So the paint is smoothed over the surface, by a Gaussian whose deviation is that distance, which leaves a few
hundredths of them; the patch is the level, linear on every triangle, that encloses the area that is painted. A straight
or a round rim that the points approximate by steps becomes straight or round again, and a mesh of any size can follow
it. It is a step of the threshold dynamics of B. Merriman, J. Bence and S. Osher, "Diffusion generated motion by mean
curvature" (1992), with the area kept.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from estimator.geometry.imprint import crease_edges
from estimator.surfaces.surface import Surface, directed_edges

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Three points of each triangle that integrate a quadratic function exactly, each for the nearest corner.
_SAMPLES = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
# Of the distance of the points: an edge of the body so near to the rim is meant by it.
_NEAR_CREASE = 0.5
# Implicit steps; with few of them what diffuses has the tail of an exponential.
_STEPS = 4


@dataclass(frozen=True, eq=False)
class Painted:
    """A patch of a surface: where a level that is given at its vertices, (n,), and linear between is not below zero."""

    level: FloatArray


def painted_patch(
    surface: Surface, is_painted: Callable[[FloatArray], BoolArray], spacing_m: float
) -> Painted:
    """Return the patch of a surface that a painting shows.

    Parameters
    ----------
    surface : Surface
    is_painted : tells for points (m, 3) of the surface, m, whether the painting has them in the patch
    spacing_m : of the points of the painting

    Examples
    --------
    >>> from estimator.geometry.shapes import sphere_surface
    >>> ball = sphere_surface(0.05, 3)
    >>> cap = painted_patch(ball, lambda points: points[:, 2] > 0.02, 7e-3)
    >>> bool((cap.level[ball.vertices[:, 2] > 0.03] > 0).all())
    True
    """
    weight = np.bincount(surface.triangles.ravel(), np.repeat(surface.areas / 3, 3), len(surface.vertices))
    samples = _SAMPLES @ surface.corners
    held = is_painted(samples.reshape(-1, 3)).reshape(-1, 3)
    thirds = (surface.areas[:, None] / 3 * held).ravel()
    share: FloatArray = np.bincount(surface.triangles.ravel(), thirds, len(weight)) / weight
    known_m = max(spacing_m, _edge_at_rim(surface, share))
    stiffness = _stiffness(surface)
    step = splu(csc_array(diags_array(weight) + known_m**2 / 2 / _STEPS * stiffness))
    for _ in range(_STEPS):
        share = np.asarray(step.solve(weight * share), dtype=np.float64)
    level = share - _enclosing(share[surface.triangles], surface.areas, float(thirds.sum()))
    return Painted(_along_creases(surface, level, known_m))


def _enclosing(corners: FloatArray, areas: FloatArray, area_m2: float) -> float:
    """Return the value above which numbers with these corners (t, 3) on triangles have an area."""
    low, middle, high = np.sort(corners, axis=1).T
    tiny = np.finfo(float).tiny

    def missing(value: float) -> float:
        below = (value - low) ** 2 / np.maximum((middle - low) * (high - low), tiny)
        above = (high - value) ** 2 / np.maximum((high - middle) * (high - low), tiny)
        part = np.where(value <= middle, 1.0 - below, above)
        return area_m2 - float(areas @ np.where(value <= low, 1.0, np.where(value >= high, 0.0, part)))

    if not 0 < area_m2 < areas.sum():
        return 0.5
    return float(brentq(missing, corners.min(), corners.max()))


def _edge_at_rim(surface: Surface, share: FloatArray) -> float:
    """Return the median length of the edges at whose ends not the same share is painted, m; 0 where there are none."""
    ends = directed_edges(surface.triangles)
    a, b = surface.vertices[ends[share[ends[:, 0]] != share[ends[:, 1]]]].transpose(1, 0, 2)
    return float(np.median(np.linalg.norm(b - a, axis=1))) if len(a) else 0.0


def _stiffness(surface: Surface) -> csc_array:
    """Return the stiffness (n, n) of linear triangles for diffusion, by half the cotangents of their angles."""
    count = len(surface.vertices)
    rows, columns, values = [], [], []
    for corner in range(3):
        opposite = surface.triangles[:, [(corner + 1) % 3, (corner + 2) % 3]]
        u, v = (surface.vertices[opposite] - surface.corners[:, corner : corner + 1]).transpose(1, 0, 2)
        half = np.einsum("tx,tx->t", u, v) / (4 * surface.areas)
        for i, j, sign in ((0, 1, -1), (1, 0, -1), (0, 0, 1), (1, 1, 1)):
            rows.append(opposite[:, i])
            columns.append(opposite[:, j])
            values.append(sign * half)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return csc_array(coo_array(entries, shape=(count, count)))


def _along_creases(surface: Surface, level: FloatArray, known_m: float) -> FloatArray:
    """Put the rim on the edges of the body that it runs along within the distance that it is known to."""
    slope = _slopes(surface, level)
    near = np.abs(level) <= _NEAR_CREASE * known_m * slope
    ends = crease_edges(surface)
    along = ends[near[ends].all(axis=1)]
    moved = level.copy()
    moved[along] = 0.0
    return moved


def _slopes(surface: Surface, level: FloatArray) -> FloatArray:
    """Return the steepest slope (n,) of a level (n,) on the triangles at each vertex, 1/m."""
    c = surface.corners
    edges = np.roll(c, -1, axis=1) - np.roll(c, 1, axis=1)
    normals = surface.area_vectors / surface.areas[:, None]
    # the gradient of a hat function is its opposite edge, turned, over twice the area
    turned = np.cross(normals[:, None], -edges)
    gradient = np.einsum("tc,tcx->tx", level[surface.triangles], turned) / (2 * surface.areas[:, None])
    steepest = np.zeros(len(level))
    np.maximum.at(steepest, surface.triangles, np.linalg.norm(gradient, axis=1)[:, None])
    return steepest
