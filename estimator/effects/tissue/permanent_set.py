"""Part of the deformation stays after unloading."""

from __future__ import annotations

from typing import ClassVar

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Effect, Readings, Values
from estimator.effects.shared.zeroing import with_wrench_zeroed
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.residual_strain import ResidualStrain
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

_SHARE = Amplitude("share", "1", scale=0.1, smallest=0.01, lower=0.0, upper=0.8)


class PermanentSet(Effect):
    """A share of the largest strain at a point remains there, also in later experiments.

    Their sensor was zeroed on tissue that pushes against the gripper at rest.
    """

    label: ClassVar[str] = "permanent_set"
    group: ClassVar[Group] = "material"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("terms", "readings")
    words: ClassVar[str] = "Part of the tissue's deformation stays after unloading."
    amplitudes = (_SHARE,)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return the stress of the strain that stays."""
        share = values[_SHARE.name]
        return (ResidualStrain.virgin(problem.body, material, share),) if share else ()

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take off the wrench in which each experiment began."""
        return with_wrench_zeroed(readings) if values[_SHARE.name] else readings


PERMANENT_SET = PermanentSet()
