"""From an energy that is a sum over the principal stretches to its derivatives by the invariants.

Let a_i be the eigenvalues of C, the roots of P(z) = z³ − I1 z² + I2 z − I3, and S = Σ φ(ln a_i). By Cauchy's theorem,
on a circle of w = ln z around all ln a_i,

    S = 1/2πi ∮ φ P′ z / P dw,   ∂S/∂I_m = −1/2πi ∮ φ′ P_m / P dw,   ∂²S/∂I_m∂I_n = 1/2πi ∮ φ′ P_m P_n / P² dw

with P_m = ∂P/∂I_m = −z², z, −1. The trapezoidal rule on the circle converges geometrically (L. N. Trefethen and
J. A. C. Weideman, SIAM Rev. 56 (2014) 385), here to rounding. Nothing is special where eigenvalues coalesce: they only
place the circle, so that it does not matter how well they themselves are known there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import SolverError
from estimator.materials.law import FloatArray

ComplexArray = NDArray[np.complex128]

# Distance from the outermost ln a_i to the circle; the next poles, at ln a_i ± 2πi, stay well outside.
_MARGIN = 1.0
_DIGITS = 36.0  # e^−36: below rounding


@dataclass(frozen=True, slots=True)
class PrincipalSums:
    """Sums over the principal stretches at n points.

    Attributes
    ----------
    j : (n,)
    log : (k, n) the points w of the upper half of the circle
    z : (k, n) e^w
    polynomial, polynomial_slope : (k, n) P and P′ at z
    weight : (k, n) what the trapezoidal rule weighs the points by, over P
    """

    j: FloatArray
    log: ComplexArray
    z: ComplexArray
    polynomial: ComplexArray
    polynomial_slope: ComplexArray
    weight: ComplexArray

    @classmethod
    def of(cls, i1: FloatArray, i2: FloatArray, j: FloatArray, growth: float) -> "PrincipalSums":
        """Place the circles for invariants of shape (n,).

        Parameters
        ----------
        growth : φ grows no faster than exp(growth |w|)

        Raises
        ------
        SolverError
            J is not positive somewhere: the material is turned inside out.
        """
        if not np.all(j > 0):
            raise SolverError(
                "the deformation turns material inside out (J is not positive); take a smaller step"
            )
        low, high = _log_eigenvalues(i1, i2, j)
        centre, half = (low + high) / 2, (high - low) / 2
        radius = half + _MARGIN
        points = _points(float(half.max()), growth)
        turn = np.exp(2j * np.pi * (np.arange(points // 2) + 0.5) / points)[:, None]
        log = centre + radius * turn
        z = np.exp(log)
        polynomial = ((z - i1) * z + i2) * z - j**2
        slope = (3 * z - 2 * i1) * z + i2
        # Twice the upper half: at the mirrored point everything is the complex conjugate.
        return cls(j, log, z, polynomial, slope, 2 * radius * turn / points / polynomial)

    def value(self, energy: ComplexArray) -> FloatArray:
        """Return S (n,) for the energy φ (k, n) on the circle; φ is analytic, and real on the real axis."""
        return _sum(energy * self.polynomial_slope * self.z, self.weight)

    def first(self, slope: ComplexArray) -> FloatArray:
        """Return the derivatives (3, n) of S by I1, I2, J for φ′ (k, n) on the circle."""
        density = slope * self.weight
        third = density.sum(axis=0).real
        return np.stack([_sum(density * self.z, self.z), -_sum(density, self.z), 2 * self.j * third])

    def second(self, slope: ComplexArray) -> FloatArray:
        """Return the second derivatives (6, n) of S by I1I1, I1I2, I1J, I2I2, I2J, JJ."""
        density = slope * self.weight
        third = density.sum(axis=0).real
        density /= self.polynomial
        squares = self.z * self.z
        once, twice = density * self.z, density * squares
        j = self.j
        return np.stack(
            [
                _sum(twice, squares),
                -_sum(once, squares),
                2 * j * twice.sum(axis=0).real,
                twice.sum(axis=0).real,
                -2 * j * once.sum(axis=0).real,
                2 * third + 4 * j**2 * density.sum(axis=0).real,
            ]
        )


def _sum(one: ComplexArray, other: ComplexArray) -> FloatArray:
    return np.einsum("kn,kn->n", one, other).real


def _points(half: float, growth: float) -> int:
    """Return the even number of points for circles around ln a_i that lie within ``half`` of their centre."""
    radius = half + _MARGIN
    inner = np.log1p(_MARGIN / max(half, 1e-6))
    outer = np.log(np.hypot(half, 2 * np.pi) / radius)
    needed = max(_DIGITS / min(inner, outer), np.e * growth * radius + 25.0)
    return 2 * int(np.ceil(needed / 2))


def _log_eigenvalues(i1: FloatArray, i2: FloatArray, j: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ln a of the smallest and of the largest eigenvalue, (n,) each, to a few digits."""
    mean, spread = i1 / 3, np.sqrt(np.maximum(i1**2 - 3 * i2, 0.0)) / 3
    skew = (2 * i1**3 - 9 * i1 * i2 + 27 * j**2) / 54
    tiny = np.finfo(float).tiny
    angle = np.arccos(np.clip(skew / np.maximum(spread**3, tiny), -1.0, 1.0)) / 3
    largest = mean + 2 * spread * np.cos(angle)
    middle = mean + 2 * spread * np.cos(angle - 2 * np.pi / 3)
    # Their product is J²; the smallest one by itself would be a difference of large numbers.
    return np.log(j**2 / (largest * middle)), np.log(largest)
