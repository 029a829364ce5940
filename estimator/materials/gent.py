"""The Gent law: chains that reach their limit at x = Jm.

    w = −(Jm/2) ln(1 − x/Jm)

The shape parameter is the inverse 1/Jm, so that the Neo-Hookean law is at zero.
Source: A. N. Gent, Rubber Chem. Technol. 69 (1996) 59.
"""

import numpy as np

from estimator.errors import SolverError
from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter


class Gent:
    """w = −(Jm/2) ln(1 − x/Jm)."""

    name = "gent"
    shape_parameters = (ShapeParameter("inverse_limit", null=0.0, lower=0.0, upper=5.0, scale=0.1),)

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says.

        Raises
        ------
        SolverError
            Somewhere x reaches the limit Jm, where the energy is infinite.
        """
        inverse_limit = float(shape[0])
        invariants = ModifiedInvariants.of(i1, i2, j)
        x = invariants.x
        used = inverse_limit * x
        if not np.all(used < 1):
            raise SolverError(
                f"the deformation exceeds the limit of the Gent law (x = {x.max():.4g}, "
                f"1/Jm = {inverse_limit:.4g}); take a smaller step, or a larger limit"
            )
        rest = 1 - used
        return invariants.energy(
            x / 2 if inverse_limit == 0 else -np.log1p(-used) / (2 * inverse_limit),
            first=(0.5 / rest, 0.0),
            second=(0.5 * inverse_limit / rest**2, 0.0, 0.0),
            first_by_shape=[(0.5 * x / rest**2, 0.0)],
        )
