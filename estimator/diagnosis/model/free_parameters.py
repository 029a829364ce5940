"""The free parameters of a hypothesis, each on the scale on which a fit moves it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from estimator.diagnosis.model.hypothesis import LARGEST_POISSON_RATIO, Hypothesis
from estimator.effects.effect import Amplitude, Constant, Effect
from estimator.fit.parameters import POISSON_RATIO, YOUNGS_MODULUS, FitParameter

MATERIAL: tuple[FitParameter, ...] = (YOUNGS_MODULUS, replace(POISSON_RATIO, upper=LARGEST_POISSON_RATIO))


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
