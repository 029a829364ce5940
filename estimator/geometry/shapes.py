"""The surfaces of regular bodies: a sphere of even triangles, and a block with a grid on its faces."""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def sphere_surface(radius_m: float, subdivisions: int) -> Surface:
    """Return a sphere around the origin: an icosahedron whose 20 triangles are quartered so many times."""
    golden = (1 + np.sqrt(5)) / 2
    rectangle = np.array([(0.0, a, b * golden) for a, b in product((-1, 1), repeat=2)])
    points = np.concatenate([np.roll(rectangle, axis, axis=1) for axis in range(3)])
    triangles = np.asarray(ConvexHull(points).simplices, dtype=np.int64)
    for _ in range(subdivisions):
        a, b, c = np.moveaxis(points[triangles], 1, 0)
        quarters = [(a, a + b, a + c), (a + b, b, b + c), (a + c, b + c, c), (a + b, b + c, a + c)]
        corners = np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
        corners /= np.linalg.norm(corners, axis=2, keepdims=True)
        points, triangles = corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    points = radius_m * points / np.linalg.norm(points, axis=1, keepdims=True)
    return closed_surface(points, triangles, "sphere")


def block_surface(size_m: tuple[float, float, float], cells: tuple[int, int, int] = (1, 1, 1)) -> Surface:
    """Return a block around the origin, its faces divided into so many squares along x, y and z."""
    corners = []
    for axis, side in product(range(3), (-0.5, 0.5)):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        i, j = np.meshgrid(np.arange(cells[u]), np.arange(cells[v]), indexing="ij")
        for di, dj in (((0, 1, 1), (0, 0, 1)), ((0, 1, 0), (0, 1, 1))):
            triangles = np.full((i.size, 3, 3), side)
            triangles[:, :, u] = (i.ravel()[:, None] + di) / cells[u] - 0.5
            triangles[:, :, v] = (j.ravel()[:, None] + dj) / cells[v] - 0.5
            corners.append(triangles)
    points = np.concatenate(corners).reshape(-1, 3) * size_m
    return closed_surface(points, np.arange(len(points)).reshape(-1, 3), "block")
