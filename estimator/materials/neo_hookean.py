"""The Neo-Hookean law: w = x/2, the baseline that every other law contains.

Source: the paper's eq. (4), W = ½[μ(i₁−3) − μ ln i₃ + λ(√i₃−1)²] with i₃ = J², less its volumetric term.
"""

from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter


class NeoHookean:
    """w = x/2."""

    name = "neo_hookean"
    shape_parameters: tuple[ShapeParameter, ...] = ()

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        del shape  # there is none
        invariants = ModifiedInvariants.of(i1, i2, j)
        return invariants.energy(invariants.x / 2, first=(0.5, 0.0), second=(0.0, 0.0, 0.0))
