"""The Mooney-Rivlin law: a share m of the small-strain energy depends on the second invariant.

    w = (1 − m) x/2 + m y/2

At J = 1 this is W = C10 (I1 − 3) + C01 (I2 − 3) with μ = 2 (C10 + C01) and m = C01 / (C10 + C01).
Source: M. Mooney, J. Appl. Phys. 11 (1940) 582; R. S. Rivlin, Phil. Trans. R. Soc. A 241 (1948) 379.
A negative m softens in tension and is unstable in other modes from some stretch on.

Carried over to J ≠ 1 by isochoric invariants (G. A. Holzapfel, Nonlinear Solid Mechanics, 2000, section 6.5) it is

    w = x/2 + m/2 (J^(−4/3) I2 − J^(−2/3) I1)

The two differ where a tissue of low Poisson's ratio changes its volume.
"""

import numpy as np

from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter

_SHARE = ShapeParameter("second_invariant_share", null=0.0, lower=-1.0, upper=1.0, scale=0.2)


class MooneyRivlin:
    """w = (1 − m) x/2 + m y/2."""

    name = "mooney_rivlin"
    shape_parameters = (_SHARE,)

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        share = float(shape[0])
        invariants = ModifiedInvariants.of(i1, i2, j)
        return invariants.energy(
            ((1 - share) * invariants.x + share * invariants.y) / 2,
            first=((1 - share) / 2, share / 2),
            second=(0.0, 0.0, 0.0),
            first_by_shape=[(-0.5, 0.5)],
        )


class IsochoricMooneyRivlin:
    """w = x/2 + m/2 (J^(−4/3) I2 − J^(−2/3) I1)."""

    name = "isochoric_mooney_rivlin"
    shape_parameters = (_SHARE,)

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        half = float(shape[0]) / 2
        x = ModifiedInvariants.of(i1, i2, j)
        one, two = j ** (-2 / 3), j ** (-4 / 3)
        moved = np.array([-one, two, (2 * one * i1 - 4 * two * i2) / (3 * j)])
        none, present = np.zeros_like(j), np.full_like(j, 0.5)
        return EnergyDerivatives(
            value=x.x / 2 + half * (two * i2 - one * i1),
            first=np.array([present, none, x.x_j / 2]) + half * moved,
            second=np.array(
                [
                    none,
                    none,
                    half * 2 * one / (3 * j),
                    none,
                    -half * 4 * two / (3 * j),
                    x.x_jj / 2 + half * (28 * two * i2 - 10 * one * i1) / (9 * j**2),
                ]
            ),
            first_by_shape=moved[None] / 2,
        )
