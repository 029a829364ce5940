"""The tissue is stiffer along one direction in the plane."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Values
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.fibres import BucklingFibres, Fibres
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# Along the fibres Young's modulus grows by four times this share.
_FIBRES = Amplitude("fibre_modulus_over_modulus", "1", scale=0.1, smallest=0.01, lower=0.0, upper=10.0)
# The direction repeats after π; the bounds let a refinement cross that seam.
_ANGLE = Constant(
    "fibre_angle", "rad", tuple(float(n * np.pi / 12) for n in range(12)), lower=-np.pi, upper=2 * np.pi
)

# Of the square of the fibres' own I4 − 1 in the exponent. From much more a search must not begin: in a few elements at
# the edges of the grasp, which without fibres are drawn to more than twice their length, the stress of the first ones
# would be a thousand times that anywhere else.
_RATE = Constant("fibre_stiffening", "1", (0.1,), lower=0.02, upper=5.0)
# κ of Gasser, Ogden and Holzapfel: 0 where all have one direction, 1/3 where they have none.
_DISPERSION = Constant("dispersion", "1", (0.1,), lower=0.0, upper=0.3)
# Of two families, each from their mean direction; at a quarter of π no direction in the plane is the mean one.
_APART = Constant("half_angle_apart", "rad", (0.4,), lower=0.02, upper=0.75)


class Anisotropy(Effect):
    """Fibres in the plane, at ``fibre_angle`` from the x axis towards the y axis."""

    label: ClassVar[str] = "anisotropy"
    group: ClassVar[Group] = "material"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("terms",)
    words: ClassVar[str] = "The tissue is stiffer along one direction in the plane."
    amplitudes = (_FIBRES,)
    constants: tuple[Constant, ...] = (_ANGLE,)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return the fibres."""
        if not values[_FIBRES.name]:
            return ()
        angle = values[_ANGLE.name]
        direction = np.array([np.cos(angle), np.sin(angle), 0.0])
        return (self._fibres(problem, values[_FIBRES.name] * material.youngs_modulus, direction, values),)

    def _fibres(
        self, problem: RetractionProblem, modulus_pa: float, direction: FloatArray, values: Values
    ) -> Fibres:
        return Fibres(problem.body, modulus_pa, direction)


class TensionOnly(Anisotropy):
    """Fibres that buckle under compression and stiffen under tension."""

    form = "tension_only"
    constants: tuple[Constant, ...] = (_ANGLE, _RATE)

    def _fibres(
        self, problem: RetractionProblem, modulus_pa: float, direction: FloatArray, values: Values
    ) -> Fibres:
        return BucklingFibres(problem.body, modulus_pa, direction, values[_RATE.name])


class Dispersed(TensionOnly):
    """Fibres of tension alone whose directions scatter."""

    form = "dispersed"
    elaborates = "tension_only"
    constants = (_ANGLE, _RATE, _DISPERSION)

    def _fibres(
        self, problem: RetractionProblem, modulus_pa: float, direction: FloatArray, values: Values
    ) -> Fibres:
        dispersion, rate = values[_DISPERSION.name], values[_RATE.name]
        return BucklingFibres(problem.body, modulus_pa, direction, rate, dispersion=dispersion)


class TwoFamilies(TensionOnly):
    """Two families of fibres of tension alone, to either side of ``fibre_angle``, each of which scatters or does not.

    A weave; the layers of a skin; or a fan in the plane, which scatter in space alone does not describe.
    """

    form = "two_families"
    elaborates = "tension_only"
    constants = (_ANGLE, _RATE, _APART)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return the fibres of both, half of the modulus in each."""
        half = {**values, _FIBRES.name: 0.5 * values[_FIBRES.name]}
        aside = (values[_ANGLE.name] + sign * values[_APART.name] for sign in (-1, 1))
        return tuple(
            term
            for angle in aside
            for term in super(TwoFamilies, self).terms(
                problem, material, experiment, {**half, _ANGLE.name: angle}
            )
        )


ANISOTROPY = (Anisotropy(), TensionOnly(), Dispersed(), TwoFamilies())
