"""The Veronda-Westmann law of soft tissue: exponential in the first invariant, linear in the second.

    w = (1 − m) (exp(α x) − 1) / (2 α) + m y/2

At J = 1 this is W = C1 [exp(α (I1 − 3)) − 1] + C2 (I2 − 3) with μ = 2 (α C1 + C2) and m = C2 / (α C1 + C2).
The original ties C2 = −α C1/2, which is m = −1; with m = 0 it is Demiray's law.
Source: D. R. Veronda and R. A. Westmann, J. Biomech. 3 (1970) 111; H. Demiray, J. Biomech. 5 (1972) 309.
"""

import numpy as np

from estimator.errors import SolverError
from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter

_EXPONENT_LIMIT = 100.0


class VerondaWestmann:
    """w = (1 − m) (exp(α x) − 1) / (2 α) + m y/2."""

    name = "veronda_westmann"
    shape_parameters = (
        ShapeParameter("exponent", null=0.0, lower=0.0, upper=50.0, scale=0.1),
        ShapeParameter("second_invariant_share", null=0.0, lower=-1.0, upper=1.0, scale=0.2),
    )

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says.

        Raises
        ------
        SolverError
            The exponent α x is too large for a number to hold the energy.
        """
        exponent, share = (float(value) for value in shape)
        invariants = ModifiedInvariants.of(i1, i2, j)
        x = invariants.x
        if np.any(exponent * x > _EXPONENT_LIMIT):
            raise SolverError(
                f"the Veronda-Westmann energy overflows (α = {exponent:.4g}, x = {x.max():.4g}); "
                "take a smaller step"
            )
        growth = np.exp(exponent * x)
        integral = x if exponent == 0 else np.expm1(exponent * x) / exponent
        half = (1 - share) / 2
        return invariants.energy(
            half * integral + share / 2 * invariants.y,
            first=(half * growth, share / 2),
            second=(half * exponent * growth, 0.0, 0.0),
            first_by_shape=[(half * x * growth, 0.0), (-growth / 2, 0.5)],
        )
