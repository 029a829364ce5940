"""Tissue whose natural size has changed, by an even pressure that it puts on itself.

A linear change α of the natural size in all directions asks for the stress −3 K α of a body that cannot change its
size (K the bulk modulus; B. A. Boley & J. H. Weiner, "Theory of Thermal Stresses", 1960, section 1.12). As a pressure
s = 3 K α on the deformed tissue it has the energy −s V, V the deformed volume.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import AddedEnergy, Body, Response, nodal_forces
from estimator.fem.terms.term import Memoryless, TermStiffness
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Swelling(Memoryless):
    """What swells the tissue evenly.

    Attributes
    ----------
    body : Body
    pressure_pa : s, negative where it shrinks
    """

    body: Body
    pressure_pa: float

    @classmethod
    def by_strain(cls, body: Body, material: Material, strain: float) -> Swelling:
        """Return what changes the natural size of a material by a linear strain, negative where it shrinks."""
        thrice_bulk_modulus = material.youngs_modulus / (1.0 - 2.0 * material.poisson_ratio)
        return cls(body, thrice_bulk_modulus * strain)

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N."""
        return nodal_forces(self.body, response, self._slope(response))

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the derivative of :meth:`forces`."""
        none = np.zeros((6, *response.dilatation.shape))
        return TermStiffness(energy=AddedEnergy(self._slope(response), none))

    def _slope(self, response: Response) -> FloatArray:
        """Return the derivatives (3, e, q) of the energy density −s J by I1, I2 and J."""
        slope = np.zeros_like(response.slope)
        slope[2] = -self.pressure_pa
        return slope
