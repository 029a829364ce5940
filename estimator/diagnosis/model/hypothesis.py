"""A hypothesis: the baseline with some effects, its free parameters, and where they stand."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant, Effect, Motion, Readings
from estimator.experiment import Experiment
from estimator.fem.body import with_modulus
from estimator.fem.morph import with_beads_at
from estimator.fem.problem import RetractionProblem
from estimator.fem.terms import Term
from estimator.fit.parameters import POISSON_RATIO, YOUNGS_MODULUS, FitParameter
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
# Nearer to one half nothing more can be told by these sensors, and every state would take many small steps.
LARGEST_POISSON_RATIO = 0.497
MATERIAL: tuple[FitParameter, ...] = (YOUNGS_MODULUS, replace(POISSON_RATIO, upper=LARGEST_POISSON_RATIO))


@dataclass(frozen=True)
class Hypothesis:
    """The baseline with some effects, at given parameter values.

    Attributes
    ----------
    youngs_modulus, poisson_ratio : Pa, 1
    effects : in the order in which they act
    values : parameters of each effect, by name
    """

    youngs_modulus: float
    poisson_ratio: float
    effects: tuple[Effect, ...] = ()
    values: tuple[Mapping[str, float], ...] = ()

    def material(self) -> Material:
        """Return the tissue's law with all effects on it."""
        material = Material(NeoHookean(), self.youngs_modulus, self.poisson_ratio)
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
        if type(effect).seen is Effect.seen:
            return False
        return any(
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
        if parameter == YOUNGS_MODULUS.name:
            return replace(self, youngs_modulus=value)
        return replace(self, poisson_ratio=value)

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


@dataclass(frozen=True)
class FreeParameter:
    """One free parameter of a hypothesis on the scale on which a fit moves it.

    Attributes
    ----------
    name : "youngs_modulus", or "label:form.parameter"
    unit : of the value
    effect : number of the effect it belongs to; None for the material
    parameter : its name there
    scale : of its prior, internal units; None for the material, whose prior is flat
    has_null : whether the prior pulls it to zero: an amplitude, no constant
    step : internal, small enough for a difference quotient
    lower, upper : bounds of the value
    value_of, internal_of : the transformation
    """

    name: str
    unit: str
    effect: int | None
    parameter: str
    scale: float | None
    has_null: bool
    step: float
    lower: float
    upper: float
    value_of: Callable[[float], float]
    internal_of: Callable[[float], float]

    def get(self, hypothesis: Hypothesis) -> float:
        """Return the internal value."""
        if self.effect is None:
            return self.internal_of(float(getattr(hypothesis, self.parameter)))
        return self.internal_of(hypothesis.values[self.effect][self.parameter])

    @property
    def prior_precision(self) -> float:
        """Inverse of the prior's deviation, internal units; 0 where the prior is flat."""
        return 0.0 if self.scale is None else 1.0 / self.scale

    def prior_offset(self, hypothesis: Hypothesis) -> float:
        """Return how far it stands from its null, in prior deviations; 0 for what has none."""
        return self.get(hypothesis) * self.prior_precision if self.has_null else 0.0

    def put(self, hypothesis: Hypothesis, internal: float) -> Hypothesis:
        """Return the hypothesis with another internal value, kept within the bounds."""
        value = min(max(self.value_of(internal), self.lower), self.upper)
        if self.effect is None:
            return hypothesis.with_material(self.parameter, value)
        changed = [dict(values) for values in hypothesis.values]
        changed[self.effect][self.parameter] = value
        return replace(hypothesis, values=tuple(changed))


def free_parameters(hypothesis: Hypothesis) -> tuple[FreeParameter, ...]:
    """Return the free parameters: E and ν first, then amplitudes and constants of each effect."""
    found = [_of_material(parameter) for parameter in MATERIAL]
    for number, effect in enumerate(hypothesis.effects):
        found += [_of_amplitude(number, effect, amplitude) for amplitude in effect.amplitudes]
        found += [_of_constant(number, effect, c) for c in effect.constants if not c.fixed]
    return tuple(found)


def _of_material(parameter: FitParameter) -> FreeParameter:
    unit = "Pa" if parameter is YOUNGS_MODULUS else "1"
    return FreeParameter(
        parameter.name,
        unit,
        None,
        parameter.name,
        None,
        False,
        1e-4,
        parameter.lower,
        parameter.upper,
        parameter.from_internal,
        parameter.to_internal,
    )


def _of_amplitude(number: int, effect: Effect, amplitude: Amplitude) -> FreeParameter:
    return FreeParameter(
        f"{effect.name}.{amplitude.name}",
        amplitude.unit,
        number,
        amplitude.name,
        amplitude.scale,
        True,
        1e-3 * amplitude.scale,
        amplitude.lower,
        amplitude.upper,
        _same,
        _same,
    )


def _of_constant(number: int, effect: Effect, constant: Constant) -> FreeParameter:
    """A positive constant that spans decades is treated by its logarithm; the prior covers its range."""
    decades = constant.lower > 0 and constant.upper / constant.lower > 5
    value_of, internal_of = (math.exp, math.log) if decades else (_same, _same)
    width = internal_of(constant.upper) - internal_of(constant.lower)
    return FreeParameter(
        f"{effect.name}.{constant.name}",
        constant.unit,
        number,
        constant.name,
        width,
        False,
        1e-3 * width,
        constant.lower,
        constant.upper,
        value_of,
        internal_of,
    )


def _same(value: float) -> float:
    return value
