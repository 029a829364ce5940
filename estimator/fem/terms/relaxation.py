"""A stress that relaxes: Prony terms on the second Piola–Kirchhoff stress, integrated through time.

    S_total = S + Σ_i g_i H_i,      dH_i/dt + H_i/τ_i = dS/dt,

so that S, with the material's moduli, is what remains in the end, and 1 + Σ g_i times that at once. Over a time Δt in
which S changes linearly

    H ← exp(−Δt/τ) H + (1 − exp(−Δt/τ))/(Δt/τ) ΔS

(R. L. Taylor, K. S. Pister and G. L. Goudreau, Int. J. Numer. Meth. Engng 2 (1970) 45; J. C. Simo and T. J. R. Hughes,
"Computational Inelasticity", section 10.3). S is objective, therefore the sum is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import AddedEnergy, Body, Response, forces_of_stress, nodal_forces
from estimator.fem.assembly.stress_kernels import first_piola, second_piola
from estimator.fem.terms.stress_terms import (
    PartialEnergy,
    geometric_stiffness,
    isochoric_energy,
    isochoric_slope,
    whole_energy,
)
from estimator.fem.terms.term import BeginsAnew, TermStiffness
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
RelaxingPart = Literal["whole", "isochoric"]


@dataclass(frozen=True)
class Relaxation(BeginsAnew):
    """Prony terms in a body.

    Attributes
    ----------
    part : what relaxes: the whole stress, or the isochoric part of what Lamé's μ weighs of it
    shares, times_s : (m,) g_i and τ_i
    last : (e, q, 3, 3) S at the last state, Pa
    memory : (m, e, q, 3, 3) H_i at the last state, Pa
    seconds : since then
    """

    body: Body
    material: Material
    part: RelaxingPart
    shares: FloatArray
    times_s: FloatArray
    last: FloatArray
    memory: FloatArray
    seconds: float = 0.0

    @classmethod
    def at_rest(
        cls, body: Body, material: Material, part: RelaxingPart, shares: FloatArray, times_s: FloatArray
    ) -> Self:
        """Return terms without any memory."""
        none = np.zeros((*body.volume.shape, 3, 3))
        return cls(body, material, part, shares, times_s, none, np.zeros((len(shares), *none.shape)))

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N."""
        present = nodal_forces(self.body, response, self._gain * self._slope(response))
        return present + forces_of_stress(self.body, first_piola(response.F, self._remembered))

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the exact derivative of :meth:`forces`."""
        energy, bulk = self._part_energy(response)
        return TermStiffness(
            elements=geometric_stiffness(self.body, self._remembered),
            energy=AddedEnergy(self._gain * energy.slope, self._gain * energy.curvature, self._gain * bulk),
        )

    def starting_after(self, seconds: float) -> Self:
        """Return the terms for a state that follows the last one after some time."""
        return replace(self, seconds=seconds)

    def after(self, displacement: FloatArray, response: Response) -> Self:
        """Return the terms once a state has been reached."""
        stress = second_piola(response.F, self._slope(response))
        memory = _over(self._decay) * self.memory + _over(self._lag) * (stress - self.last)
        return replace(self, last=stress, memory=memory, seconds=0.0)

    def rested(self) -> Self:
        """Return the terms without memory: a tissue long at rest has relaxed."""
        return self.at_rest(self.body, self.material, self.part, self.shares, self.times_s)

    @property
    def _decay(self) -> FloatArray:
        return np.exp(-self.seconds / self.times_s)

    @property
    def _lag(self) -> FloatArray:
        x = np.maximum(self.seconds / self.times_s, np.finfo(float).tiny)
        return np.asarray(-np.expm1(-x) / x)

    @cached_property
    def _gain(self) -> float:
        """How many times the present stress is added."""
        return float(self.shares @ self._lag)

    @cached_property
    def _remembered(self) -> FloatArray:
        """Return what is added whatever the present stress, (e, q, 3, 3)."""
        remembered = -self._gain * self.last
        for share, memory in zip(self.shares * self._decay, self.memory, strict=True):
            remembered += share * memory
        return remembered

    def _slope(self, response: Response) -> FloatArray:
        if self.part == "whole":
            return response.slope
        return isochoric_slope(self.material, response)

    def _part_energy(self, response: Response) -> tuple[PartialEnergy, float]:
        """Return the energy whose stress relaxes, and λ as far as it is that of the projected dilatation."""
        if self.part == "whole":
            projected = self.material.lame[1] if self.body.basis.shape[2] else 0.0
            return whole_energy(self.body, self.material, response), projected
        return isochoric_energy(self.material, response), 0.0


def _over(factor: FloatArray) -> FloatArray:
    return factor[:, None, None, None, None]
