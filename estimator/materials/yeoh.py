"""The Yeoh law: a polynomial of the first invariant.

    w = ½ (x + c2 x² + c3 x³)

At J = 1 this is W = Σ Ci (I1 − 3)^i with μ = 2 C1, c2 = C2/C1, c3 = C3/C1.
Source: O. H. Yeoh, Rubber Chem. Technol. 63 (1990) 792 and 66 (1993) 754.
"""

import numpy as np

from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter

_COEFFICIENTS = (
    ShapeParameter("c2", null=0.0, lower=-0.5, upper=10.0, scale=0.1),
    ShapeParameter("c3", null=0.0, lower=-0.5, upper=10.0, scale=0.02),
)


class Yeoh:
    """w = ½ (x + c2 x²) with two terms, ½ (x + c2 x² + c3 x³) with three."""

    def __init__(self, terms: int) -> None:
        if terms not in (2, 3):
            raise ValueError(f"a Yeoh law has two or three terms, not {terms}")
        self.name = f"yeoh{terms}"
        self.shape_parameters = _COEFFICIENTS[: terms - 1]

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        invariants = ModifiedInvariants.of(i1, i2, j)
        polynomial = np.polynomial.Polynomial([0.0, 0.5, *(0.5 * np.asarray(shape))])
        slope = polynomial.deriv()
        x = invariants.x
        return invariants.energy(
            polynomial(x),
            first=(slope(x), 0.0),
            second=(slope.deriv()(x), 0.0, 0.0),
            first_by_shape=[(0.5 * power * x ** (power - 1), 0.0) for power in range(2, 2 + len(shape))],
        )
