"""The Mooney-Rivlin law: a share m of the small-strain energy depends on the second invariant.

    w = (1 − m) x/2 + m y/2

At J = 1 this is W = C10 (I1 − 3) + C01 (I2 − 3) with μ = 2 (C10 + C01) and m = C01 / (C10 + C01).
Source: M. Mooney, J. Appl. Phys. 11 (1940) 582; R. S. Rivlin, Phil. Trans. R. Soc. A 241 (1948) 379.
A negative m softens in tension and is unstable in other modes from some stretch on.
"""

from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter


class MooneyRivlin:
    """w = (1 − m) x/2 + m y/2."""

    name = "mooney_rivlin"
    shape_parameters = (ShapeParameter("second_invariant_share", null=0.0, lower=-1.0, upper=1.0, scale=0.2),)

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
