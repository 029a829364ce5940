"""After a larger strain the tissue is softer at smaller ones: the Mullins effect."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.stages import Hook, Stage
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
_RELATIVE_WIDTH = Constant("relative_width", "1", (0.0,), lower=0.0, upper=2.0)
# A search begins with these as well, beside next to no absolute width: strains of 4 %.
_TRIED_RELATIVE, _NARROW = (0.2, 0.7), 1e-3
# Of the energy in the exponent of damage: a half is that of a strain.
_ORDER = Constant("order", "1", (1.0,), lower=0.4, upper=2.0)


class StressSoftening(Effect):
    """Stress that is lost for good with the largest energy reached.

    ``depth`` is the largest share of it: 1/r of Ogden and Roxburgh, d of continuum damage. The energy over which the
    softening develops is a share of Young's modulus (their m) and a share of the largest energy at the same point (β
    of Abaqus): both, or either alone.

    Parameters
    ----------
    form : what the instance is called
    part : which energy damages and is softened
    elaborates : form of which this one is a refinement; empty for none
    """

    label: ClassVar[str] = "stress_softening"
    group: ClassVar[Group] = "material"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("terms",)
    words: ClassVar[str] = "After a larger strain the tissue is softer at smaller ones (Mullins)."
    amplitudes = (_DEPTH,)

    constants: tuple[Constant, ...] = (_WIDTH, _RELATIVE_WIDTH)

    def __init__(self, form: str, part: SofteningPart = "shear", elaborates: str = "") -> None:
        self.form = form
        self.elaborates = elaborates
        self._part = part

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return either width without the other."""
        absolute = [{_WIDTH.name: width, _RELATIVE_WIDTH.name: 0.0} for width in _WIDTH.grid]
        relative = [{_WIDTH.name: _NARROW, _RELATIVE_WIDTH.name: share} for share in _TRIED_RELATIVE]
        return [*absolute, *relative]

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return what the softening takes from the stress."""
        if not values[_DEPTH.name]:
            return ()
        return (Softening.virgin(problem.body, material, self._part, self._law(material, values)),)

    def _law(self, material: Material, values: Values) -> SofteningLaw:
        width_pa = material.youngs_modulus * values[_WIDTH.name]
        return PseudoElastic(values[_DEPTH.name], width_pa, values[_RELATIVE_WIDTH.name])


class Damage(StressSoftening):
    """Softening by which the virgin curve bends too, since the tissue is damaged as soon as it is strained."""

    constants = (_WIDTH, _ORDER)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the widths of the grid."""
        return [{_WIDTH.name: width, _ORDER.name: 1.0} for width in _WIDTH.grid]

    def _law(self, material: Material, values: Values) -> SofteningLaw:
        width_pa = material.youngs_modulus * values[_WIDTH.name]
        return ContinuumDamage(values[_DEPTH.name], width_pa, values[_ORDER.name])


STRESS_SOFTENING = (
    StressSoftening("pseudo_elastic"),
    Damage("damage"),
    StressSoftening("pseudo_elastic_isochoric", "isochoric", "pseudo_elastic"),
    Damage("damage_isochoric", "isochoric", "damage"),
    # No refinements but rivals, which the misfit alone may hardly tell apart: they part in Poisson's ratio.
    StressSoftening("pseudo_elastic_whole", "whole"),
    Damage("damage_whole", "whole"),
)
