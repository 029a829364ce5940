"""Stress that is lower after a larger strain, the Mullins effect: P = η ∂W/∂F.

W is the energy of the virgin tissue, Wm its largest value so far at the same point. Two laws of η are in use. By the
pseudo-elastic one

    η = 1 − (1/r) erf((Wm − W) / (m + β Wm))

the virgin curve stays as it is: R. W. Ogden and D. G. Roxburgh, Proc. R. Soc. A 455 (1999) 2861, with the width
m + β Wm of Abaqus ("Mullins effect"). By continuum damage

    η = 1 − d (1 − exp(−(Wm / m)^q))

it bends too, and the way back is that of a softer tissue: C. Miehe, Eur. J. Mech. A 14 (1995) 697, with q = 1; with
q = ½ the measure of damage is √(2 Wm), as in J. C. Simo, Comput. Methods Appl. Mech. Eng. 60 (1987) 153. The energy is
that which Lamé's μ weighs, or its isochoric part: a change of volume hardly damages. Or it is the whole, as where voids
and torn chains bear neither shear nor pressure: then a body that is softened evenly keeps its Poisson's ratio.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from estimator.fem.assembly.body import AddedEnergy, Body, Response, nodal_forces
from estimator.fem.terms.stress_terms import PartialEnergy, isochoric_energy, shear_energy, whole_energy
from estimator.fem.terms.term import TermStiffness
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
SofteningPart = Literal["shear", "isochoric", "whole"]

# Pairs of I1, I2, J in the order of second derivatives.
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


class SofteningLaw(Protocol):
    """How much of the stress is lost."""

    def lost(self, energy: FloatArray, largest: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return 1 − η and its derivative by W, both (e, q), of W and of the largest energy before, J/m³."""
        ...


@dataclass(frozen=True)
class PseudoElastic:
    """The law of Ogden and Roxburgh.

    Attributes
    ----------
    depth : 1/r, the largest share that is lost
    width_pa, relative_width : m (J/m³) and β; one of them at least positive
    """

    depth: float
    width_pa: float
    relative_width: float

    def lost(self, energy: FloatArray, largest: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return 1 − η and its derivative: nothing where the energy is larger than ever."""
        below = largest - energy
        width = self.width_pa + self.relative_width * largest
        softened = below > 0
        z = np.divide(below, width, out=np.zeros_like(below), where=softened)
        gaussian = np.divide(np.exp(-(z**2)), width, out=np.zeros_like(below), where=softened)
        return self.depth * erf(z), -2 / np.sqrt(np.pi) * self.depth * gaussian


@dataclass(frozen=True)
class ContinuumDamage:
    """The law of Simo and Miehe.

    Attributes
    ----------
    depth : d, the largest share that is lost
    width_pa : m, J/m³
    order : q
    """

    depth: float
    width_pa: float
    order: float = 1.0

    def lost(self, energy: FloatArray, largest: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return 1 − η and its derivative: the loss grows only where the energy is larger than ever."""
        reached = np.maximum(energy, largest)
        measure = (np.maximum(reached, 0.0) / self.width_pa) ** self.order
        left = np.exp(-measure)
        grows = (energy >= largest) & (reached > 0.0)
        slope = np.divide(
            self.depth * left * self.order * measure, reached, out=np.zeros_like(reached), where=grows
        )
        return self.depth * (1 - left), slope


@dataclass(frozen=True)
class Softening:
    """What η takes from the tissue's stress.

    Attributes
    ----------
    part : which energy damages and is softened: what Lamé's μ weighs, the isochoric part of that, or the whole
    law : of η
    largest : (e, q) Wm, J/m³
    """

    body: Body
    material: Material
    part: SofteningPart
    law: SofteningLaw
    largest: FloatArray

    @classmethod
    def virgin(cls, body: Body, material: Material, part: SofteningPart, law: SofteningLaw) -> Self:
        """Return the term of a tissue that was never strained."""
        return cls(body, material, part, law, np.zeros_like(body.volume))

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N."""
        virgin = self._virgin(response)
        lost, _ = self.law.lost(virgin.density, self.largest)
        return nodal_forces(self.body, response, -lost * virgin.slope)

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the derivative of :meth:`forces`, exact but at the kink where W = Wm.

        Of the whole, what the pressure changes by is softened evenly in each element.
        """
        virgin = self._virgin(response)
        lost, by_energy = self.law.lost(virgin.density, self.largest)
        slope = virgin.slope
        curvature = -lost * virgin.curvature
        curvature -= by_energy * np.stack([slope[i] * slope[j] for i, j in _PAIRS])
        return TermStiffness(energy=AddedEnergy(-lost * slope, curvature, self._added_bulk(lost)))

    def _added_bulk(self, lost: FloatArray) -> FloatArray | float:
        """Return the change (e,), Pa, of λ of the projected dilatation as far as that is softened."""
        if self.part != "whole" or not self.body.basis.shape[2]:
            return 0.0
        return np.asarray(-np.average(lost, axis=1, weights=self.body.volume) * self.material.lame[1])

    def starting_after(self, seconds: float) -> Self:
        """Return the term itself: softening is no matter of time."""
        return self

    def after(self, displacement: FloatArray, response: Response) -> Self:
        """Return the term that remembers the energy reached."""
        return replace(self, largest=np.maximum(self.largest, self._virgin(response).density))

    def rested(self) -> Self:
        """Return the term itself: the softening stays."""
        return self

    def _virgin(self, response: Response) -> PartialEnergy:
        if self.part == "whole":
            return whole_energy(self.body, self.material, response)
        energy = shear_energy if self.part == "shear" else isochoric_energy
        return energy(self.material, response)
