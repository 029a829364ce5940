"""Fit a hyperelastic law of your own: here the exponential one of H. Demiray, J. Biomech. 5 (1972) 309.

    w = (exp(a x) − 1) / 2a

x is the argument of :mod:`estimator.materials.law` that reduces to I1 − 3 where the volume stays. Where a is zero, the
law is the Neo-Hookean one, w = x/2. A package that declares the law as entry point of the group ``retract.materials``
makes it known to ``retract estimate --law demiray``.
"""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import exprel

from estimator import Experiment, estimate, simulate
from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, ShapeParameter

FloatArray = NDArray[np.float64]


class Demiray:
    """w = (exp(a x) − 1) / 2a."""

    name = "demiray"
    shape_parameters = (ShapeParameter("a", null=0.0, lower=0.0, upper=20.0, scale=0.5),)

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        a = float(shape[0])
        invariants = ModifiedInvariants.of(i1, i2, j)
        x, growth = invariants.x, np.exp(a * invariants.x)
        return invariants.energy(
            x * exprel(a * x) / 2,
            first=(growth / 2, 0.0),
            second=(a * growth / 2, 0.0, 0.0),
            first_by_shape=[(x * growth / 2, 0.0)],
        )


def main(steps: int = 6, mesh: Literal["fine", "coarse"] = "fine", **asked: Any) -> dict[str, float]:
    """Fit a tissue of that law by it and by the Neo-Hookean one; return the misfit of each in units of the noise.

    ``asked`` goes to :func:`estimator.estimate`.
    """
    planned = Experiment.of_block(np.outer(np.arange(steps + 1), [20e-3 / steps, 0.0, 0.0]))
    measured = simulate(planned, youngs_modulus=10e3, law=Demiray(), shape=[2.0], seed=1, mesh=mesh)
    misfit = {}
    for law in (Demiray(), "neo_hookean"):
        found = estimate(measured, law=law, **asked)
        misfit[found.law] = found.noise_ratio
        print(f"{found.law}: {found}, misfit {found.noise_ratio:.2f} times the noise")
    return misfit


if __name__ == "__main__":
    main()
