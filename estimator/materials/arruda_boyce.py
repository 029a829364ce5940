"""The Arruda-Boyce eight-chain law, by the five terms of its inverse Langevin series.

    w = Σ Ci a^(i−1) [(x + 3)^i − 3^i] / N(a),      N(a) = 2 Σ i Ci (3 a)^(i−1),      i = 1 … 5

with C = 1/2, 1/20, 11/1050, 19/7000, 519/673750. The shape parameter is a = 1/λm², λm the locking stretch, so
that the Neo-Hookean law is at zero; N keeps the small-strain modulus.
Source: E. M. Arruda and M. C. Boyce, J. Mech. Phys. Solids 41 (1993) 389.
"""

import numpy as np
from numpy.polynomial import Polynomial

from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter

_SERIES = np.array([1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750])
_POWERS = np.arange(1, 6)


class ArrudaBoyce:
    """Eight chains with finite extensibility."""

    name = "arruda_boyce"
    shape_parameters = (
        ShapeParameter("inverse_locking_stretch_squared", null=0.0, lower=0.0, upper=1.0, scale=0.1),
    )

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        a = float(shape[0])
        invariants = ModifiedInvariants.of(i1, i2, j)
        chain = invariants.x + 3  # I1 of the incompressible law

        weights = _SERIES * a ** (_POWERS - 1.0)
        weights_by_a = np.append(0.0, _SERIES[1:] * _POWERS[:-1] * a ** (_POWERS[:-1] - 1.0))
        energy, energy_by_a = Polynomial([0.0, *weights]), Polynomial([0.0, *weights_by_a])
        slope, slope_by_a = energy.deriv(), energy_by_a.deriv()
        modulus, modulus_by_a = 2 * slope(3.0), 2 * slope_by_a(3.0)

        first = slope(chain) / modulus
        return invariants.energy(
            (energy(chain) - energy(3.0)) / modulus,
            first=(first, 0.0),
            second=(slope.deriv()(chain) / modulus, 0.0, 0.0),
            first_by_shape=[((slope_by_a(chain) - first * modulus_by_a) / modulus, 0.0)],
        )
