"""Where points lie relative to a surface: inside or outside, and how far away."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimator.surfaces.bounding_tree import BoundingTree, bounding_tree
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# In radii of a node: from there on its triangles count together.
_FAR = 3.0


class _Runs(NamedTuple):
    """The nodes of a :class:`BoundingTree` without their boxes, as a named tuple, which numba can unpack."""

    order: IntArray
    first: IntArray
    last: IntArray
    child: IntArray


class _Dipoles(NamedTuple):
    """What the triangles of each node of a tree are from afar.

    Attributes
    ----------
    centres : (m, 3) of their area, m
    moments : (m, 3) their area vectors, m²
    radii : (m,) how far their boxes reach from the centre, m
    """

    centres: FloatArray
    moments: FloatArray
    radii: FloatArray


def inside(surface: Surface, points: FloatArray) -> BoolArray:
    """Tell for each of the points (m, 3) whether the surface encloses it, by its winding number.

    Far triangles count together, by their dipole (G. Barill et al., "Fast winding numbers for soups and clouds", ACM
    Trans. Graph. 37, 2018); that changes the number by less than a tenth.
    """
    lower, upper = surface.bounds
    result = np.all((points > lower) & (points < upper), axis=1)
    if not result.any():
        return result
    corners, tree = surface.corners, bounding_tree(surface.corners)
    centres, moments, radii = _dipoles(tree.order, tree.first, tree.last, tree.lower, tree.upper, corners)
    dipoles = _Dipoles(centres, moments, radii)
    numbers = _winding_number(np.ascontiguousarray(points[result]), corners, _runs_of(tree), dipoles)
    result[result] = numbers > 0.5
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
    tree = bounding_tree(corners)
    return _nearest(
        np.ascontiguousarray(corners), np.ascontiguousarray(points), _runs_of(tree), tree.lower, tree.upper
    )


def _runs_of(tree: BoundingTree) -> _Runs:
    return _Runs(tree.order, tree.first, tree.last, tree.child)


@njit(cache=True)
def _dipoles(
    order: IntArray,
    first: IntArray,
    last: IntArray,
    lower: FloatArray,
    upper: FloatArray,
    corners: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return of each node the centre of its area, its area vector, and how far its boxes reach from that centre."""
    count = len(first)
    centres, moments, radii = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    for node in range(count):
        whole = 0.0
        for place in range(first[node], last[node]):
            c = corners[order[place]]
            ux, uy, uz = c[1, 0] - c[0, 0], c[1, 1] - c[0, 1], c[1, 2] - c[0, 2]
            vx, vy, vz = c[2, 0] - c[0, 0], c[2, 1] - c[0, 1], c[2, 2] - c[0, 2]
            nx, ny, nz = (uy * vz - uz * vy) / 2, (uz * vx - ux * vz) / 2, (ux * vy - uy * vx) / 2
            area = np.sqrt(nx * nx + ny * ny + nz * nz)
            moments[node, 0] += nx
            moments[node, 1] += ny
            moments[node, 2] += nz
            for x in range(3):
                centres[node, x] += area * (c[0, x] + c[1, x] + c[2, x]) / 3
            whole += area
        reach = 0.0
        for x in range(3):
            middle = (lower[node, x] + upper[node, x]) / 2
            centres[node, x] = centres[node, x] / whole if whole > 0.0 else middle
            side = max(upper[node, x] - centres[node, x], centres[node, x] - lower[node, x])
            reach += side * side
        radii[node] = np.sqrt(reach)
    return centres, moments, radii


@njit(cache=True)
def _winding_number(points: FloatArray, corners: FloatArray, runs: _Runs, dipoles: _Dipoles) -> FloatArray:
    """Sum solid angles over 4π: near ones exactly (van Oosterom & Strackee 1983, eq. 8), far ones together."""
    order, first, last, child = runs
    centres, moments, radii = dipoles
    out = np.empty(len(points))
    stack = np.empty(128, np.int64)
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        total = 0.0
        stack[0], height = 0, 1
        while height > 0:
            height -= 1
            node = stack[height]
            ax, ay, az = centres[node, 0] - x, centres[node, 1] - y, centres[node, 2] - z
            square = ax * ax + ay * ay + az * az
            if square > (_FAR * radii[node]) ** 2:
                flux = moments[node, 0] * ax + moments[node, 1] * ay + moments[node, 2] * az
                total += flux / (square * np.sqrt(square)) / 2
                continue
            if child[node] >= 0:
                stack[height], stack[height + 1] = child[node], child[node] + 1
                height += 2
                continue
            for place in range(first[node], last[node]):
                total += _half_solid_angle(corners[order[place]], x, y, z)
        out[p] = total / (2 * np.pi)
    return out


@njit(cache=True)
def _half_solid_angle(c: FloatArray, x: float, y: float, z: float) -> float:
    ax, ay, az = c[0, 0] - x, c[0, 1] - y, c[0, 2] - z
    bx, by, bz = c[1, 0] - x, c[1, 1] - y, c[1, 2] - z
    cx, cy, cz = c[2, 0] - x, c[2, 1] - y, c[2, 2] - z
    a = np.sqrt(ax * ax + ay * ay + az * az)
    b = np.sqrt(bx * bx + by * by + bz * bz)
    d = np.sqrt(cx * cx + cy * cy + cz * cz)
    triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    below = a * b * d + (ax * bx + ay * by + az * bz) * d
    below += (bx * cx + by * cy + bz * cz) * a + (cx * ax + cy * ay + cz * az) * b
    return float(np.arctan2(triple, below))


@njit(cache=True)
def _nearest(
    corners: FloatArray, points: FloatArray, runs: _Runs, lower: FloatArray, upper: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Go down the tree, the nearer child first, and leave out the boxes that lie farther than the best so far."""
    order, first, last, child = runs
    triangle = np.empty(len(points), np.int64)
    foot = np.empty((len(points), 3))
    stack = np.empty(128, np.int64)
    for p in range(len(points)):
        point = points[p]
        best = np.inf
        stack[0], height = 0, 1
        while height > 0:
            height -= 1
            node = stack[height]
            if _box_distance(point, lower[node], upper[node]) > best:
                continue
            if child[node] >= 0:
                near, far = child[node], child[node] + 1
                if _box_distance(point, lower[far], upper[far]) < _box_distance(
                    point, lower[near], upper[near]
                ):
                    near, far = far, near
                stack[height], stack[height + 1] = far, near
                height += 2
                continue
            for place in range(first[node], last[node]):
                t = order[place]
                candidate = _foot(point, corners[t, 0], corners[t, 1], corners[t, 2])
                distance = np.sqrt(np.sum((point - candidate) ** 2))
                if distance < best or (distance == best and t < triangle[p]):
                    best = distance
                    triangle[p] = t
                    foot[p] = candidate
    return triangle, foot


@njit(cache=True)
def _box_distance(point: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    square = 0.0
    for x in range(3):
        off = max(lower[x] - point[x], point[x] - upper[x], 0.0)
        square += off * off
    return float(np.sqrt(square))


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
