"""After a larger strain the tissue is softer at smaller ones: the Mullins effect."""

from __future__ import annotations

from typing import ClassVar

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Hook, Stage, Values
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.softening import (
    ContinuumDamage,
    PseudoElastic,
    Softening,
    SofteningLaw,
    SofteningPart,
)
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

_DEPTH = Amplitude("depth", "1", scale=0.2, smallest=0.02, lower=0.0, upper=0.9)
# A tissue strained by ε holds about ε²/2 of its modulus as energy per volume: these are strains of 6, 14 and 32 %.
_WIDTH = Constant("width_over_modulus", "1", (0.002, 0.01, 0.05), lower=1e-4, upper=1.0)
_RELATIVE_WIDTH = Constant("relative_width", "1", (0.2, 0.7), lower=0.02, upper=5.0)


class StressSoftening(Effect):
    """Stress that is lost for good with the largest energy reached.

    ``depth`` is the largest share of it: 1/r of Ogden and Roxburgh, d of continuum damage. The energy over which the
    softening develops is a share of Young's modulus (their m), or of the largest energy at the same point (β of
    Abaqus), as ``width`` says.

    Parameters
    ----------
    form : what the instance is called
    width : the constant that states it
    part : which energy damages and is softened
    elaborates : form of which this one is a refinement; empty for none
    """

    label: ClassVar[str] = "stress_softening"
    group: ClassVar[Group] = "material"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("terms",)
    words: ClassVar[str] = "After a larger strain the tissue is softer at smaller ones (Mullins)."
    amplitudes = (_DEPTH,)

    def __init__(
        self, form: str, width: Constant, part: SofteningPart = "shear", elaborates: str = ""
    ) -> None:
        self.form = form
        self.elaborates = elaborates
        self._part = part
        self.constants = (width,)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return what the softening takes from the stress."""
        if not values[_DEPTH.name]:
            return ()
        return (Softening.virgin(problem.body, material, self._part, self._law(material, values)),)

    def _law(self, material: Material, values: Values) -> SofteningLaw:
        width_pa = material.youngs_modulus * values.get(_WIDTH.name, 0.0)
        return PseudoElastic(values[_DEPTH.name], width_pa, values.get(_RELATIVE_WIDTH.name, 0.0))


class Damage(StressSoftening):
    """Softening by which the virgin curve bends too, since the tissue is damaged as soon as it is strained."""

    def _law(self, material: Material, values: Values) -> SofteningLaw:
        return ContinuumDamage(values[_DEPTH.name], material.youngs_modulus * values[_WIDTH.name])


STRESS_SOFTENING = (
    StressSoftening("absolute_width", _WIDTH),
    StressSoftening("relative_width", _RELATIVE_WIDTH),
    Damage("damage", _WIDTH),
    StressSoftening("absolute_isochoric", _WIDTH, "isochoric", "absolute_width"),
    StressSoftening("relative_isochoric", _RELATIVE_WIDTH, "isochoric", "relative_width"),
    Damage("damage_isochoric", _WIDTH, "isochoric", "damage"),
    # No refinements but rivals, which the misfit alone may hardly tell apart: they part in Poisson's ratio.
    StressSoftening("absolute_whole", _WIDTH, "whole"),
    StressSoftening("relative_whole", _RELATIVE_WIDTH, "whole"),
    Damage("damage_whole", _WIDTH, "whole"),
)
