"""A hypothesis: the baseline with some effects, at given parameter values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Effect, Motion, Readings
from estimator.experiment import Experiment
from estimator.fem.assembly.body import with_modulus
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.morph import with_beads_at
from estimator.fem.terms.term import Term
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS
from estimator.materials import NeoHookean
from estimator.materials.law import Law
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
# Nearer to one half nothing more can be told by these sensors, and every state would take many small steps.
LARGEST_POISSON_RATIO = 0.497
MATERIAL: tuple[FreeParameter, ...] = (YOUNGS_MODULUS, replace(POISSON_RATIO, upper=LARGEST_POISSON_RATIO))


@dataclass(frozen=True)
class Hypothesis:
    """The baseline with some effects, at given parameter values.

    Attributes
    ----------
    youngs_modulus, poisson_ratio : Pa, 1
    effects : in the order in which they act
    values : parameters of each effect, by name
    law, shape : of the tissue
    free_material : E and ν as far as they are not given, with their bounds and with what is known of them beforehand
    """

    youngs_modulus: float
    poisson_ratio: float
    effects: tuple[Effect, ...] = ()
    values: tuple[Mapping[str, float], ...] = ()
    law: Law = field(default_factory=NeoHookean, kw_only=True)
    shape: tuple[float, ...] = field(default=(), kw_only=True)
    free_material: tuple[FreeParameter, ...] = field(default=MATERIAL, kw_only=True, compare=False)

    def material(self) -> Material:
        """Return the tissue's law with all effects on it."""
        material = Material(self.law, self.youngs_modulus, self.poisson_ratio, np.array(self.shape))
        for effect, values in zip(self.effects, self.values, strict=True):
            material = effect.material(material, values)
        return material

    def problem(self, problem: RetractionProblem) -> RetractionProblem:
        """Return the boundary value problem with all effects on it."""
        if any(map(self.rest_misread_by, self.effects)):
            problem = with_beads_at(problem, self._unseen(problem.fiducials_rest))
        for effect, values in zip(self.effects, self.values, strict=True):
            problem = effect.problem(problem, values)
        fields = [e.log_modulus(problem, v) for e, v in zip(self.effects, self.values, strict=True)]
        present = [field for field in fields if field is not None]
        if present:
            problem = replace(problem, body=with_modulus(problem.body, np.exp(sum(present))))
        return problem

    def rest_misread_by(self, effect: Effect) -> bool:
        """Tell whether cameras that an effect distorts have read the beads' rest positions: they are not there."""
        return "seen" in effect.acts_on and any(
            present.rest_seen and any(values[amplitude.name] for amplitude in present.amplitudes)
            for present, values in zip(self.effects, self.values, strict=True)
        )

    def _unseen(self, positions: FloatArray) -> FloatArray:
        """Return where beads are that are seen at positions (m, 3), m."""
        found = positions
        for _ in range(3):
            found = positions - (self._seen(found) - found)
        return found

    def _seen(self, positions: FloatArray) -> FloatArray:
        for effect, values in zip(self.effects, self.values, strict=True):
            positions = effect.seen(positions, values)
        return positions

    def with_beads(self, problem: RetractionProblem, at_rest: FloatArray) -> RetractionProblem:
        """Return the problem with its beads on the tissue that they sit on.

        ``at_rest`` (n, 3) is how the nodes are displaced, m, with the gripper at rest.
        """
        for effect, values in zip(self.effects, self.values, strict=True):
            problem = effect.beads(problem, at_rest, values)
        return problem

    def terms(self, problem: RetractionProblem, experiment: Experiment) -> tuple[Term, ...]:
        """Return the terms of all effects at the start of an experiment."""
        material = self.material()
        found: tuple[Term, ...] = ()
        for effect, values in zip(self.effects, self.values, strict=True):
            found += effect.terms(problem, material, experiment, values)
        return found

    def motion(self, motion: Motion) -> Motion:
        """Return the gripper's true motion."""
        for effect, values in zip(self.effects, self.values, strict=True):
            motion = effect.motion(motion, values)
        return motion

    def readings(self, readings: Readings) -> Readings:
        """Return what the sensors make of the truth."""
        present = zip(self.effects, self.values, strict=True)
        # What was zeroed by what distorted cameras saw was distorted before.
        for effect, values in sorted(present, key=lambda one: not self.rest_misread_by(one[0])):
            readings = effect.readings(readings, values)
        return readings

    def with_material(self, parameter: str, value: float) -> Hypothesis:
        """Return the hypothesis with another Young's modulus or Poisson's ratio."""
        found = {**self.of_material, parameter: value}
        return replace(
            self, youngs_modulus=found[YOUNGS_MODULUS.name], poisson_ratio=found[POISSON_RATIO.name]
        )

    def with_material_between(self, other: Hypothesis, share: float) -> Hypothesis:
        """Return the hypothesis with E and ν that have gone a share of the way from another's to its own."""
        found = self
        for one in self.free_material:
            here, there = one.at(self.of_material[one.name]), one.at(other.of_material[one.name])
            between = there.after(share * (here.internal - there.internal))
            found = found.with_material(one.name, between.value)
        return found

    @property
    def of_material(self) -> dict[str, float]:
        """Young's modulus and Poisson's ratio by their names."""
        return {YOUNGS_MODULUS.name: self.youngs_modulus, POISSON_RATIO.name: self.poisson_ratio}

    @property
    def rate_dependent(self) -> bool:
        """Whether the tissue changes while the gripper stands."""
        return any(effect.rate_dependent for effect in self.effects)

    @property
    def without_small_regions(self) -> Hypothesis:
        """The hypothesis without the effects that end within elements."""
        kept = [
            (effect, values)
            for effect, values in zip(self.effects, self.values, strict=True)
            if not effect.within_elements
        ]
        return replace(
            self, effects=tuple(effect for effect, _ in kept), values=tuple(values for _, values in kept)
        )

    def with_effect(self, effect: Effect, values: Mapping[str, float]) -> Hypothesis:
        """Return the hypothesis with one effect more."""
        return replace(self, effects=(*self.effects, effect), values=(*self.values, dict(values)))


def negligible_effects(hypothesis: Hypothesis, share: float = 1.0) -> tuple[Effect, ...]:
    """Return the effects whose every amplitude is below a share of the smallest that anybody would care for."""
    return tuple(
        effect
        for effect, values in zip(hypothesis.effects, hypothesis.values, strict=True)
        if all(abs(values[amplitude.name]) < share * amplitude.smallest for amplitude in effect.amplitudes)
    )
