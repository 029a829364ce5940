"""Fibres of one direction through the whole tissue.

    W = k/2 (I4 − 1)²,      I4 = a·C a,      S = 2k (I4 − 1) a ⊗ a

for fibres that bear tension and compression alike: the standard reinforcing model (G. Y. Qiu and T. J. Pence, J.
Elasticity 49 (1997) 1). Along a small strain they add 4k to Young's modulus. Fibres that buckle bear nothing where
I4 < 1 (G. A. Holzapfel, T. C. Gasser and R. W. Ogden, J. Elasticity 61 (2000) 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from estimator.fem.body import Body, Response, forces_of_stress
from estimator.fem.stress_terms import geometric_stiffness, product_stiffness
from estimator.fem.terms import TermStiffness

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Fibres:
    """Fibres along the unit vector ``direction`` (3,) at rest, with modulus k in Pa."""

    body: Body
    modulus_pa: float
    direction: FloatArray

    def energy(self, response: Response) -> float:
        """Return the energy stored, J."""
        return float(np.sum(self.body.volume * 0.5 * self.modulus_pa * self._extension(response) ** 2))

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N."""
        along = self._along(response)
        return forces_of_stress(
            self.body, (2 * self.modulus_pa * self._extension(response))[..., None, None] * along
        )

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the exact derivative of :meth:`forces`."""
        tension = (2 * self.modulus_pa * self._extension(response))[..., None, None]
        along = self._along(response)
        elements = geometric_stiffness(self.body, tension * np.outer(self.direction, self.direction))
        elements += product_stiffness(self.body, along, along, 4 * self.modulus_pa * self._bearing(response))
        return TermStiffness(elements=elements)

    def starting_after(self, seconds: float) -> Self:
        """Return the term itself: it has no memory."""
        return self

    def after(self, displacement: FloatArray, response: Response) -> Self:
        """Return the term itself: it has no memory."""
        return self

    def rested(self) -> Self:
        """Return the term itself: it has no memory."""
        return self

    def _extension(self, response: Response) -> FloatArray:
        """Return I4 − 1 where they bear, (e, q)."""
        return np.sum((response.F @ self.direction) ** 2, axis=-1) - 1.0

    def _bearing(self, response: Response) -> FloatArray:
        """Return 1 where they bear, (e, q)."""
        return np.ones_like(self.body.volume)

    def _along(self, response: Response) -> FloatArray:
        """Return F a ⊗ a, (e, q, 3, 3)."""
        return np.asarray((response.F @ self.direction)[..., :, None] * self.direction)


@dataclass(frozen=True)
class BucklingFibres(Fibres):
    """Fibres that bear tension alone."""

    def _extension(self, response: Response) -> FloatArray:
        return np.maximum(super()._extension(response), 0.0)

    def _bearing(self, response: Response) -> FloatArray:
        return np.asarray(super()._extension(response) > 0.0, dtype=np.float64)
