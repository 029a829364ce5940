"""Fibres of one direction through the whole tissue, an energy of I4 = a·C a; S = 2 ∂W/∂I4 a ⊗ a.

Fibres that bear tension and compression alike, the standard reinforcing model (G. Y. Qiu and T. J. Pence, J. Elasticity
49 (1997) 1), which along a small strain add 4k to Young's modulus:

    W = k/2 (I4 − 1)²

Fibres that buckle, and stiffen as they are drawn (G. A. Holzapfel, T. C. Gasser and R. W. Ogden, J. Elasticity 61
(2000) 1):

    W = k/(2 c) (exp(c (I4 − 1)²) − 1) where I4 > 1, else 0

Fibres whose directions scatter about a have the extension E = κ (I1 − 3) + (1 − 3 κ) (I4 − 1) in place of I4 − 1, from
κ = 0, all alike, to κ = 1/3, none (T. C. Gasser, R. W. Ogden and G. A. Holzapfel, J. R. Soc. Interface 3 (2006) 15).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Body, Response, forces_of_stress
from estimator.fem.terms.stress_terms import geometric_stiffness, product_stiffness
from estimator.fem.terms.term import Memoryless, TermStiffness

FloatArray = NDArray[np.float64]

# Of a field that is no equilibrium: the correction after it is shortened.
_LARGEST_EXPONENT = 50.0


@dataclass(frozen=True)
class Fibres(Memoryless):
    """Fibres along the unit vector ``direction`` (3,) at rest, with modulus k in Pa, scattered by κ."""

    body: Body
    modulus_pa: float
    direction: FloatArray
    dispersion: float = field(default=0.0, kw_only=True)

    def energy(self, response: Response) -> float:
        """Return the energy stored, J."""
        density, _, _ = self._by_extension(self._extension(response))
        return float(np.sum(self.body.volume * density))

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N."""
        _, slope, _ = self._by_extension(self._extension(response))
        return forces_of_stress(self.body, 2 * slope[..., None, None] * self._along(response))

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the exact derivative of :meth:`forces`."""
        _, slope, curvature = self._by_extension(self._extension(response))
        along = self._along(response)
        tension = 2 * slope[..., None, None]
        elements = geometric_stiffness(self.body, tension * self._structure)
        elements += product_stiffness(self.body, along, along, 4 * curvature)
        return TermStiffness(elements=elements)

    def _by_extension(self, extension: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the energy density of I4 − 1, its slope and its curvature, (e, q) Pa."""
        k = self.modulus_pa
        return 0.5 * k * extension**2, k * extension, np.full_like(extension, k)

    @property
    def _structure(self) -> FloatArray:
        """Return κ 1 + (1 − 3 κ) a ⊗ a, (3, 3)."""
        along = np.outer(self.direction, self.direction)
        return self.dispersion * np.eye(3) + (1 - 3 * self.dispersion) * along

    def _extension(self, response: Response) -> FloatArray:
        """Return E, (e, q), which is I4 − 1 where all are alike."""
        return np.sum((response.F @ self._structure) * response.F, axis=(-2, -1)) - 1.0

    def _along(self, response: Response) -> FloatArray:
        """Return F times the structure, (e, q, 3, 3), which is F a ⊗ a where all are alike."""
        return np.asarray(response.F @ self._structure)


@dataclass(frozen=True)
class BucklingFibres(Fibres):
    """Fibres that bear tension alone, and stiffen at the rate c."""

    rate: float

    def _by_extension(self, extension: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        k, c = self.modulus_pa, self.rate
        taut = np.maximum(extension, 0.0)
        grown = np.exp(np.minimum(c * taut**2, _LARGEST_EXPONENT))
        curvature = np.where(extension > 0.0, k * (1 + 2 * c * taut**2) * grown, 0.0)
        return k / (2 * c) * (grown - 1), k * taut * grown, curvature
