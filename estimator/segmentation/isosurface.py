"""The surface where a field on a grid has a level, by marching tetrahedra.

Each cell is cut into six tetrahedra about its diagonal (H. W. Kuhn, 1960), in which the level's surface is one or two
triangles: unlike marching cubes there are no ambiguous cases, so the surface is closed and has no edge of more than two
triangles, whatever the field.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Corners 0 to 7 of a cell have the offsets of their bits (i: 1, j: 2, k: 4); each tetrahedron goes from 0 to 7.
_TETRAHEDRA = np.array(
    [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]], dtype=np.int64
)
# A crossing stays this share of its edge away from the ends, so that no triangle is without area.
_FROM_ENDS = 0.02


class Isosurface(NamedTuple):
    """A closed surface around what lies above the level.

    Attributes
    ----------
    vertices : (n, 3) float64, in indices of the grid
    triangles : (t, 3) int64, anticlockwise seen from below the level
    """

    vertices: FloatArray
    triangles: IntArray

    @property
    def volume(self) -> float:
        """Volume that it encloses, in cells."""
        a, b, c = np.moveaxis((self.vertices - self.vertices.mean(axis=0))[self.triangles], 1, 0)
        return float(np.einsum("tx,tx->", np.cross(a, b), c)) / 6

    @property
    def area(self) -> float:
        """Its area, in faces of cells."""
        a, b, c = np.moveaxis(self.vertices[self.triangles], 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


def isosurface(field: NDArray[np.float32], level: float) -> Isosurface:
    """Return the surface of a level in a field (i, j, k) that lies below it all around."""
    values = np.ascontiguousarray(field)
    keys = np.empty((_count(values, level), 3), dtype=np.int64)
    _fill(values, level, keys)
    edges, triangles = np.unique(keys, return_inverse=True)
    points, way = np.divmod(edges, 8)
    offset = np.stack([way & 1, (way >> 1) & 1, (way >> 2) & 1], axis=1)
    start = np.stack(np.unravel_index(points, values.shape), axis=1)
    near, far = values[tuple(start.T)].astype(float), values[tuple((start + offset).T)].astype(float)
    share = np.clip((level - near) / (far - near), _FROM_ENDS, 1 - _FROM_ENDS)
    return Isosurface(start + share[:, None] * offset, triangles.reshape(-1, 3).astype(np.int64))


@njit(cache=True)
def _count(values: NDArray[np.float32], level: float) -> int:
    """Return how many triangles there are: one or two in a tetrahedron."""
    total = 0
    shape = values.shape
    inside = np.empty(8, np.int64)
    for i in range(shape[0] - 1):
        for j in range(shape[1] - 1):
            for k in range(shape[2] - 1):
                if not _corners(values, level, i, j, k, inside):
                    continue
                for tetrahedron in range(6):
                    above = 0
                    for corner in range(4):
                        above += inside[_TETRAHEDRA[tetrahedron, corner]]
                    total += (0, 1, 2, 1, 0)[above]
    return total


@njit(cache=True)
def _fill(values: NDArray[np.float32], level: float, keys: IntArray) -> None:
    """Write the three edges of the grid that each triangle has its corners on: eight times the point plus the way."""
    shape = values.shape
    inside = np.empty(8, np.int64)
    above, below = np.empty(4, np.int64), np.empty(4, np.int64)
    row = 0
    for i in range(shape[0] - 1):
        for j in range(shape[1] - 1):
            for k in range(shape[2] - 1):
                if not _corners(values, level, i, j, k, inside):
                    continue
                base = (i * shape[1] + j) * shape[2] + k
                for tetrahedron in range(6):
                    ups, downs = 0, 0
                    # the permutation that puts those above first, odd or even
                    odd = tetrahedron in (1, 2, 5)
                    for corner in range(4):
                        if inside[_TETRAHEDRA[tetrahedron, corner]]:
                            above[ups] = _TETRAHEDRA[tetrahedron, corner]
                            ups += 1
                            odd ^= downs % 2 == 1
                        else:
                            below[downs] = _TETRAHEDRA[tetrahedron, corner]
                            downs += 1
                    if ups == 0 or downs == 0:
                        continue
                    a, b, c = above[0], above[1], above[2]
                    d, e, f = below[0], below[1], below[2]
                    if ups == 1:
                        _write(keys, row, odd, base, shape, (a, d, a, e, a, f))
                    elif ups == 3:
                        _write(keys, row, odd, base, shape, (a, d, b, d, c, d))
                    else:
                        _write(keys, row, odd, base, shape, (a, d, a, e, b, e))
                        row += 1
                        _write(keys, row, odd, base, shape, (a, d, b, e, b, d))
                    row += 1


@njit(cache=True)
def _corners(values: NDArray[np.float32], level: float, i: int, j: int, k: int, inside: IntArray) -> bool:
    """Tell which corners of a cell lie above the level, and whether some do and some do not."""
    found = 0
    for corner in range(8):
        inside[corner] = values[i + (corner & 1), j + ((corner >> 1) & 1), k + (corner >> 2)] > level
        found += inside[corner]
    return 0 < found < 8


@njit(cache=True)
def _write(
    keys: IntArray,
    row: int,
    odd: bool,
    base: int,
    shape: tuple[int, int, int],
    ends: tuple[int, int, int, int, int, int],
) -> None:
    """Write a triangle, whose corners lie between the ends of three edges."""
    second, third = (2, 1) if odd else (1, 2)
    keys[row, 0] = _edge(base, shape, ends[0], ends[1])
    keys[row, second] = _edge(base, shape, ends[2], ends[3])
    keys[row, third] = _edge(base, shape, ends[4], ends[5])


@njit(cache=True)
def _edge(base: int, shape: tuple[int, int, int], one: int, other: int) -> int:
    low, high = (
        min(one, other),
        max(one, other),
    )  # along a tetrahedron's edge the bits of one are among the other's
    point = base + ((low & 1) * shape[1] + ((low >> 1) & 1)) * shape[2] + (low >> 2)
    return point * 8 + (high - low)
