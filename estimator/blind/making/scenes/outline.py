"""Bodies that are no block: one-to-one maps of the block's mesh to an organ-like body, a cylinder, an uneven sheet."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Vector = tuple[float, float, float]

_HALF = 0.05
# Cells of the surface that is written, along x, y and z.
_CELLS = (48, 48, 8)


class Outline(Protocol):
    """A body by the map of the block of 0.1 × 0.1 × 0.01 m to it; faces across x stay plane."""

    @property
    def layers(self) -> int:
        """How many times as many cells as a sheet's are wanted through the height."""
        ...

    def shaped(self, grid: FloatArray) -> FloatArray:
        """Return where points (n, 3) of the block lie in the body, m."""
        ...

    def top(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the height (n,) of the upper face above places (n,) of the body, m."""
        ...


@dataclass(frozen=True, slots=True)
class Organ:
    """A lobe: domed above, hollow below, tapered and rounded towards −y; as thick as a sheet where it is gripped.

    Attributes
    ----------
    dome : by how much the middle is thicker than 10 mm, m
    hollow : by how much the underside rises in the middle, m
    taper : share of the width that is lost at −y and midway
    """

    dome: float
    hollow: float
    taper: float
    layers: int = 1

    def shaped(self, grid: FloatArray) -> FloatArray:
        """Return places, as :class:`Outline` says."""
        x, y, z = grid.T
        bulge = _bulge(x, y)
        # Only beyond y = −35 mm, so that beads and grasp lie where the block's would.
        outer = np.maximum(-y - 0.035, 0.0)
        narrower = y + self.taper * outer * (1 - (x / _HALF) ** 2)
        thickness = 0.01 + self.dome * bulge
        return np.column_stack([x, narrower, z / 0.01 * thickness + self._lifted(bulge)])

    def top(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return heights, as :class:`Outline` says."""
        bulge = _bulge(x, y)
        return (0.01 + self.dome * bulge) / 2 + self._lifted(bulge)

    def flat(self, points: FloatArray) -> FloatArray:
        """Return where points (n, 3) of the body, within 35 mm of its middle along y, lie in the block, m."""
        x, y, z = points.T
        bulge = _bulge(x, y)
        return np.column_stack([x, y, 0.01 * (z - self._lifted(bulge)) / (0.01 + self.dome * bulge)])

    def _lifted(self, bulge: FloatArray) -> FloatArray:
        return (self.dome / 2 + self.hollow) * bulge


def _bulge(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return a smooth hump over the sheet, nothing at the anchor and where it is gripped."""
    along = np.clip((x + _HALF) / 0.075, 0.0, 1.0)
    return np.sin(np.pi * along) ** 2 * np.cos(np.pi * np.clip(y / 0.12, -0.5, 0.5)) ** 2


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder along x, of a radius, m: the square of the block's section mapped to a disc (elliptical grid)."""

    radius: float
    layers: int = 3

    def shaped(self, grid: FloatArray) -> FloatArray:
        """Return places, as :class:`Outline` says."""
        x, y, z = grid[:, 0], grid[:, 1] / _HALF, grid[:, 2] / 0.005
        return np.column_stack(
            [x, self.radius * y * np.sqrt(1 - z**2 / 2), self.radius * z * np.sqrt(1 - y**2 / 2)]
        )

    def top(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return heights, as :class:`Outline` says."""
        return np.sqrt(np.maximum(self.radius**2 - y**2, 0.0))


@dataclass(frozen=True, slots=True)
class Uneven:
    """A sheet whose thickness changes with the place, its middle plane flat.

    Attributes
    ----------
    relative : of places x, y (n,) m, the thickness over 10 mm
    """

    relative: Callable[[FloatArray, FloatArray], FloatArray]
    layers: int = 1

    def shaped(self, grid: FloatArray) -> FloatArray:
        """Return places, as :class:`Outline` says."""
        x, y, z = grid.T
        return np.column_stack([x, y, z * self.relative(x, y)])

    def top(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return heights, as :class:`Outline` says."""
        return 0.005 * self.relative(x, y)


def surface_of(outline: Outline) -> tuple[FloatArray, IntArray]:
    """Return the closed triangulated surface of a body: vertices (v, 3) m and triangles (t, 3), outward."""
    upper = (_HALF, _HALF, 0.005)
    grid, triangles = brick_surface((-_HALF, -_HALF, -0.005), upper, _CELLS)
    return outline.shaped(grid), triangles


def brick_surface(lower: Vector, upper: Vector, cells: tuple[int, int, int]) -> tuple[FloatArray, IntArray]:
    """Return the surface of a brick in so many cells along each axis: vertices (v, 3) and triangles (t, 3), outward."""
    lines = [np.linspace(low, high, n + 1) for low, high, n in zip(lower, upper, cells, strict=True)]
    number: dict[tuple[int, int, int], int] = {}
    triangles: list[tuple[int, int, int]] = []

    def vertex(place: tuple[int, int, int]) -> int:
        return number.setdefault(place, len(number))

    for axis in range(3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, cells[axis]):
            for a in pairwise(range(cells[one] + 1)):
                for b in pairwise(range(cells[other] + 1)):
                    around = ((a[0], b[0]), (a[1], b[0]), (a[1], b[1]), (a[0], b[1]))
                    p, q, r, s = (vertex(_placed(axis, side, i, j)) for i, j in around)
                    triangles += [(p, q, r), (p, r, s)] if side else [(p, r, q), (p, s, r)]
    grid = np.array([[lines[k][place[k]] for k in range(3)] for place in number])
    return grid, np.array(triangles, dtype=np.int64)


def _placed(axis: int, side: int, i: int, j: int) -> tuple[int, int, int]:
    place = [0, 0, 0]
    place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3] = side, i, j
    return place[0], place[1], place[2]
