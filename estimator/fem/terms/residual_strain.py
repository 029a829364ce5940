"""A share of the largest strain that stays once the tissue is unloaded.

    S = −(1 − W/Wm) 2μ c dev(E_m)      while W < Wm

with the energy W and its largest value Wm so far at the same point, and the Green–Lagrange strain E_m it had there:
free tissue comes to rest near the strain c dev(E_m). As in A. Dorfmann and R. W. Ogden, Int. J. Solids Struct. 41
(2004) 1855, the residual stress is absent on virgin loading and comes in full at W = 0; their growth with W/Wm, a
hyperbolic tangent, is nearly a line, which is taken here. The strain that stays does not change the volume.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Body, Response, forces_of_stress, stress_of
from estimator.fem.assembly.stress_kernels import first_piola
from estimator.fem.terms.stress_terms import (
    geometric_stiffness,
    green_lagrange,
    product_stiffness,
    shear_energy,
)
from estimator.fem.terms.term import TermStiffness
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ResidualStrain:
    """The stress of a strain that stays.

    Attributes
    ----------
    share : c
    largest : (e, q) Wm, J/m³
    strain : (e, q, 3, 3) deviator of the strain that went with it
    """

    body: Body
    material: Material
    share: float
    largest: FloatArray
    strain: FloatArray

    @classmethod
    def virgin(cls, body: Body, material: Material, share: float) -> Self:
        """Return the term of a tissue that was never strained."""
        return cls(body, material, share, np.zeros_like(body.volume), np.zeros((*body.volume.shape, 3, 3)))

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N."""
        return forces_of_stress(self.body, first_piola(response.F, self._stress(response)))

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the symmetric part of the derivative of :meth:`forces`: the whole of it is not symmetric."""
        energy = shear_energy(self.material, response)
        rate = np.divide(
            2 * self.material.lame[0] * self.share,
            self.largest,
            out=np.zeros_like(self.largest),
            where=energy.density < self.largest,
        )
        own = stress_of(response.F, energy.slope)
        elements = geometric_stiffness(self.body, self._stress(response))
        elements += product_stiffness(self.body, response.F @ self.strain, own, rate)
        return TermStiffness(elements=elements)

    def starting_after(self, seconds: float) -> Self:
        """Return the term itself: the set is no matter of time."""
        return self

    def after(self, displacement: FloatArray, response: Response) -> Self:
        """Return the term that remembers the strain reached."""
        energy = shear_energy(self.material, response).density
        strain = green_lagrange(response.F)
        deviator = strain - np.trace(strain, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
        farther = energy > self.largest
        return replace(
            self,
            largest=np.maximum(self.largest, energy),
            strain=np.where(farther[..., None, None], deviator, self.strain),
        )

    def rested(self) -> Self:
        """Return the term itself: the strain stays."""
        return self

    def _stress(self, response: Response) -> FloatArray:
        energy = shear_energy(self.material, response).density
        softened = energy < self.largest
        used = np.divide(energy, self.largest, out=np.ones_like(energy), where=softened)
        factor = -2 * self.material.lame[0] * self.share * (1 - used)
        return np.asarray(factor[..., None, None] * self.strain)
