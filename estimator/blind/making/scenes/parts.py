"""Parts of a body: a cavity, or a region of another modulus; bricks of the block that the body is a map of."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.brick_mesh import Break
from estimator.blind.making.scenes.outline import Organ, Outline, brick_surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Vector = tuple[float, float, float]

# Cells of a part's surface that is written, along x, y and z.
_CELLS = (12, 12, 6)


@dataclass(frozen=True, slots=True)
class Part:
    """A brick, before the block is mapped to the body.

    Attributes
    ----------
    kind : what it is
    lower, upper : its corners in the block, m
    modulus_ratio : of a region's modulus to that of the rest
    """

    kind: Literal["cavity", "region"]
    lower: Vector
    upper: Vector
    modulus_ratio: float = 1.0

    def holds(self, grid: FloatArray) -> NDArray[np.bool_]:
        """Tell which points (n, 3) of the block lie in it."""
        return np.asarray(((grid > self.lower) & (grid < self.upper)).all(axis=1))

    def breaks(self, axis: int, edge: float) -> tuple[Break, Break]:
        """Return the planes across an axis in which it ends, with the edge length wanted there, m."""
        return Break(self.lower[axis], edge), Break(self.upper[axis], edge)

    def surface(self, outline: Outline) -> tuple[FloatArray, IntArray]:
        """Return its closed surface in the body: vertices (v, 3) m and triangles (t, 3), outward."""
        grid, triangles = brick_surface(self.lower, self.upper, _CELLS)
        return outline.shaped(grid), triangles


def drawn_parts(random: np.random.Generator) -> tuple[Part, Part]:
    """Draw a cyst and a tumour, beside each other where an organ is thickest."""
    cyst = _brick(random, (-0.038, -0.020), 0.0015, 0.0025)
    tumour = _brick(random, (-0.012, 0.010), 0.0020, 0.0030)
    ratio = round(float(np.exp(random.uniform(np.log(1.8), np.log(4.0)))), 2)
    return Part("cavity", *cyst), Part("region", *tumour, ratio)


def _brick(
    random: np.random.Generator, x: tuple[float, float], thin: float, thick: float
) -> tuple[Vector, Vector]:
    """Return the corners of a brick between two places along x, of half a height from thin to thick, m."""
    width, height = float(random.uniform(0.012, 0.020)), float(random.uniform(thin, thick))
    middle, shorter = float(random.uniform(-0.012, 0.012)), float(random.uniform(0.0, 0.003))
    lower = round(x[0] + shorter, 6), round(middle - width / 2, 6), round(-height, 6)
    upper = round(x[1] - shorter, 6), round(middle + width / 2, 6), round(height, 6)
    return lower, upper


def stiffness_of(parts: tuple[Part, ...], organ: Organ) -> Callable[[FloatArray], FloatArray]:
    """Return the factor of the modulus at points of an organ with these parts."""

    def factor(points: FloatArray) -> FloatArray:
        grid = organ.flat(points)
        found = np.ones(len(points))
        for part in parts:
            found[part.holds(grid)] *= part.modulus_ratio
        return found

    return factor
