"""Planes across which the tissue bears less, as across a cut: an energy of v = C a − a, a their normal at rest.

    W = −½ (k_n v_n² + k_s |v_s|²)

v_n, the component along a, is at small strain twice the stretching across the plane, and v_s the sliding along it:
4 k_n is taken from Young's modulus across, and k_s from the shear modulus; along the plane nothing is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimator.fem.body import Body, Response, forces_of_stress
from estimator.fem.stress_terms import geometric_stiffness, product_stiffness
from estimator.fem.terms import Memoryless, TermStiffness

FloatArray = NDArray[np.float64]

# Elements whose largest share is less than this of the largest anywhere bear all.
_WHOLE = 1e-4


@dataclass(frozen=True, eq=False)
class WeakPlanes(Memoryless):
    """What parallel planes take from the tissue's stress.

    Attributes
    ----------
    body : Body
    axes : (3, 3) orthonormal rows at rest, the planes' normal first
    lost_pa : (3, e, q) k_n, k_s and k_s again, where the planes are
    """

    body: Body
    axes: FloatArray
    lost_pa: FloatArray

    def energy(self, response: Response) -> float:
        """Return what is taken from the energy stored, J, as a negative number."""
        lost = self.lost_pa[:, self._weak]
        return float(-0.5 * np.sum(self._patch.volume * lost * self._stretch(response) ** 2))

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N."""
        lost = self.lost_pa[:, self._weak] * self._stretch(response)
        stress = np.zeros_like(response.F)
        stress[self._weak] = -np.einsum("ieq,ieqxy->eqxy", lost, self._slope(response))
        return forces_of_stress(self.body, stress)

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the exact derivative of :meth:`forces`."""
        moduli = self.lost_pa[:, self._weak]
        pairs = self.axes[0][None, :, None] * self.axes[:, None, :]
        tension = np.einsum("ieq,ixy->eqxy", moduli * self._stretch(response), pairs + pairs.swapaxes(1, 2))
        of_patch = geometric_stiffness(self._patch, -tension)
        for slope, modulus in zip(self._slope(response), moduli, strict=True):
            of_patch += product_stiffness(self._patch, slope, slope, -modulus)
        elements = np.zeros((len(self.body.volume), *of_patch.shape[1:]))
        elements[self._weak] = of_patch
        return TermStiffness(elements=elements)

    @cached_property
    def _weak(self) -> NDArray[np.int64]:
        largest = np.abs(self.lost_pa).max(axis=(0, 2))
        return np.flatnonzero(largest > _WHOLE * largest.max())

    @cached_property
    def _patch(self) -> Body:
        """The elements that are weak, for their integration data."""
        body, weak = self.body, self._weak
        return replace(body, gradient=body.gradient[weak], volume=body.volume[weak], basis=body.basis[weak])

    def _stretch(self, response: Response) -> FloatArray:
        """Return the components (3, e, q) of v along the axes in the weak elements."""
        turned = response.F[self._weak] @ self.axes.T
        inner = np.einsum("eqx,eqxi->ieq", turned[..., 0], turned)
        inner[0] -= 1.0
        return np.asarray(inner)

    def _slope(self, response: Response) -> FloatArray:
        """Return the derivatives (3, e, q, 3, 3) of v's components by F there: F a ⊗ b + F b ⊗ a."""
        turned = response.F[self._weak] @ self.axes.T
        first = np.einsum("eqx,iy->ieqxy", turned[..., 0], self.axes)
        second = np.einsum("eqxi,y->ieqxy", turned, self.axes[0])
        return np.asarray(first + second)
