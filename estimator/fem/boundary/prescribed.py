"""A part of the boundary whose motion was measured, as a function of where the gripper is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PrescribedMotion:
    """Displacements of k degrees of freedom: a polynomial of the gripper's way, zero at rest.

    It is linear along each of some axes, with higher powers along the first of them: a body that remembers nothing
    follows the gripper, so that the noise of single rows averages out.

    Attributes
    ----------
    led : (n, 3) bool, the degrees of freedom
    origin : (3,) of the gripper's frame at rest, m
    axes : (a, 3) unit vectors
    powers : the highest along the first of the axes
    coefficients : (k, a + powers − 1), of each axis and then of the second and higher powers
    """

    led: BoolArray
    origin: FloatArray
    axes: FloatArray
    powers: int
    coefficients: FloatArray

    def displacement(self, position: FloatArray) -> FloatArray:
        """Return the displacements (k,), m, with the gripper's origin at a position (3,), m."""
        return self.coefficients @ terms_of(position - self.origin, self.axes, self.powers)

    def by_position(self, position: FloatArray) -> FloatArray:
        """Return their derivative (k, 3) by that position."""
        way = self.axes @ (position - self.origin)
        higher = [n * way[0] ** (n - 1) * self.axes[0] for n in range(2, self.powers + 1)]
        return np.asarray(self.coefficients @ np.vstack([self.axes, *higher]))


def terms_of(way: FloatArray, axes: FloatArray, powers: int) -> FloatArray:
    """Return the terms (a + powers − 1, ...) of ways (..., 3), m."""
    along = np.moveaxis(way @ axes.T, -1, 0)
    return np.concatenate([along, [along[0] ** n for n in range(2, powers + 1)]]) if powers > 1 else along
