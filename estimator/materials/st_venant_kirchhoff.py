"""The St. Venant-Kirchhoff law: Hooke's law between the Green–Lagrange strain and the second Piola–Kirchhoff stress.

    W = μ E:E + λ/2 (tr E)²,      E = ½(C − 1)

so that w = E:E = ¼ (I1² − 2 I1 − 2 I2 + 3), and λ weighs tr E = (I1 − 3)/2 instead of J − 1. It softens in compression
until it loses its stability, and does not become incompressible near ν = 1/2: it keeps tr E, not J.
Source: A. J. C. B. de Saint-Venant, C. R. Acad. Sci. 24 (1847) 260; G. Kirchhoff, Sitzungsber. Akad. Wiss. Wien 9
(1852) 762; P. G. Ciarlet, "Mathematical Elasticity" I (1988), section 3.9.
"""

import numpy as np

from estimator.errors import SolverError
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter


class StVenantKirchhoff:
    """w = E:E, and λ on tr E."""

    name = "st_venant_kirchhoff"
    shape_parameters: tuple[ShapeParameter, ...] = ()

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        del shape  # there is none
        if not np.all(j > 0):
            raise SolverError(
                "the deformation turns material inside out (J is not positive); take a smaller step"
            )
        zero = np.zeros_like(i1)
        return EnergyDerivatives(
            value=(i1**2 - 2 * i1 - 2 * i2 + 3) / 4,
            first=np.stack([(i1 - 1) / 2, zero - 0.5, zero]),
            second=np.stack([zero + 0.5, zero, zero, zero, zero, zero]),
            first_by_shape=np.zeros((0, 3, len(i1))),
            dilatation_by=(0.5, 0.0, 0.0),
        )
