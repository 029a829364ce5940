"""A part of the boundary whose motion was measured, as a function of where the gripper is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PowersOfWay:
    """The gripper's way along each of some axes, and higher powers of that along the first; all zero at rest.

    Attributes
    ----------
    origin : (3,) of the gripper's frame at rest, m
    axes : (a, 3) unit vectors
    powers : the highest along the first of the axes
    """

    origin: FloatArray
    axes: FloatArray
    powers: int

    def terms(self, position: FloatArray) -> FloatArray:
        """Return the a + powers − 1 terms (t, ...) with the gripper's origin at positions (..., 3), m."""
        along = np.moveaxis((position - self.origin) @ self.axes.T, -1, 0)
        higher = [along[:1] ** n for n in range(2, self.powers + 1)]
        return np.concatenate([along, *higher])

    def by_position(self, position: FloatArray) -> FloatArray:
        """Return the derivative (t, 3) of the terms by a position (3,)."""
        way = self.axes[0] @ (position - self.origin)
        higher = [n * way ** (n - 1) * self.axes[0] for n in range(2, self.powers + 1)]
        return np.vstack([self.axes, *higher])


@dataclass(frozen=True, eq=False)
class PrescribedMotion:
    """Displacements of k degrees of freedom as the gripper goes its way: they follow it, and remember nothing.

    Attributes
    ----------
    led : (n, 3) bool, the degrees of freedom
    way : of which the displacements are linear combinations
    coefficients : (k, t) of its terms
    """

    led: BoolArray
    way: PowersOfWay
    coefficients: FloatArray

    def displacement(self, position: FloatArray) -> FloatArray:
        """Return the displacements (k,), m, with the gripper's origin at a position (3,), m."""
        return np.asarray(self.coefficients @ self.way.terms(position))

    def by_position(self, position: FloatArray) -> FloatArray:
        """Return their derivative (k, 3) by that position."""
        return np.asarray(self.coefficients @ self.way.by_position(position))
