"""Where points lie relative to a surface: inside or outside, and how far away."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimator.geometry.surface import Surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def inside(surface: Surface, points: FloatArray) -> BoolArray:
    """Tell for each of the points (m, 3) whether the surface encloses it, by its winding number."""
    lower, upper = surface.bounds
    result = np.all((points > lower) & (points < upper), axis=1)
    result[result] = _winding_number(points[result], surface.corners) > 0.5
    return result


def nearest(corners: FloatArray, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return for each of the points (m, 3) the nearest triangle and the nearest point on it.

    Parameters
    ----------
    corners : (t, 3, 3) float64, corners of the triangles, m
    points : (m, 3) float64, m

    Returns
    -------
    triangle : (m,) int64
    foot : (m, 3) float64, m
    """
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    return _nearest(np.ascontiguousarray(corners), centres, radii, np.ascontiguousarray(points))


@njit(cache=True)
def _winding_number(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Sum the solid angles of the triangles over 4π (van Oosterom & Strackee 1983, eq. 8)."""
    out = np.empty(len(points))
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        total = 0.0
        for t in range(len(corners)):
            c = corners[t]
            ax, ay, az = c[0, 0] - x, c[0, 1] - y, c[0, 2] - z
            bx, by, bz = c[1, 0] - x, c[1, 1] - y, c[1, 2] - z
            cx, cy, cz = c[2, 0] - x, c[2, 1] - y, c[2, 2] - z
            a = np.sqrt(ax * ax + ay * ay + az * az)
            b = np.sqrt(bx * bx + by * by + bz * bz)
            d = np.sqrt(cx * cx + cy * cy + cz * cz)
            triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            below = a * b * d + (ax * bx + ay * by + az * bz) * d
            below += (bx * cx + by * cy + bz * cz) * a + (cx * ax + cy * ay + cz * az) * b
            total += np.arctan2(triple, below)
        out[p] = total / (2 * np.pi)
    return out


@njit(cache=True)
def _nearest(
    corners: FloatArray, centres: FloatArray, radii: FloatArray, points: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Search all triangles, leaving out those whose bounding sphere lies farther than the best so far."""
    triangle = np.empty(len(points), np.int64)
    foot = np.empty((len(points), 3))
    for p in range(len(points)):
        point = points[p]
        best = np.inf
        for t in range(len(corners)):
            apart = 0.0
            for i in range(3):
                apart += (point[i] - centres[t, i]) ** 2
            if apart >= (best + radii[t]) ** 2:
                continue
            candidate = _foot(point, corners[t, 0], corners[t, 1], corners[t, 2])
            distance = np.sqrt(np.sum((point - candidate) ** 2))
            if distance < best:
                best = distance
                triangle[p] = t
                foot[p] = candidate
    return triangle, foot


@njit(cache=True)
def _foot(p: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the point of a triangle nearest to ``p`` (Ericson, "Real-Time Collision Detection", 5.1.5)."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = np.dot(ab, ap), np.dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return a
    bp = p - b
    d3, d4 = np.dot(ab, bp), np.dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return b
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return a + d1 / (d1 - d3) * ab
    cp = p - c
    d5, d6 = np.dot(ab, cp), np.dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return c
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return a + d2 / (d2 - d6) * ac
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)
    scale = 1.0 / (va + vb + vc)
    return a + vb * scale * ab + vc * scale * ac
