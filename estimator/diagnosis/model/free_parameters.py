"""The free parameters of a hypothesis, each on the scale on which a fit moves it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.settings import FittingSettings
from estimator.effects.effect import Amplitude, Constant, Effect
from estimator.inference.free_parameter import IDENTITY, LOGARITHM, FreeParameter, NormalPrior, RangePrior

FloatArray = NDArray[np.float64]

# Of E and ν, small enough for a difference quotient; of the others a thousandth of their prior's deviation. Nodes that
# have slid under a load that grows evenly stay near to sliding: a hundredth of that, and none seems to begin or stop.
_STEP_OF_MATERIAL, _STEP, _STEP_AT_THRESHOLDS = 1e-4, 1e-3, 1e-5
_USUAL = FittingSettings()


@dataclass(frozen=True, kw_only=True)
class HypothesisParameter(FreeParameter):
    """A free parameter with its place in a hypothesis.

    Attributes
    ----------
    name : "youngs_modulus", or "label:form.parameter"
    effect : number of the effect it belongs to; None for the material
    key : its name there
    step : internal, small enough for a difference quotient
    """

    effect: int | None
    key: str
    step: float

    def of(self, hypothesis: Hypothesis) -> HypothesisParameter:
        """Return the parameter as it is in a hypothesis."""
        values = hypothesis.of_material if self.effect is None else hypothesis.values[self.effect]
        return replace(self, value=values[self.key])

    def put(self, hypothesis: Hypothesis, internal: float) -> Hypothesis:
        """Return the hypothesis with another internal value, kept within the bounds."""
        value = self.at(self.transform.value_of(internal)).value
        if self.effect is None:
            return hypothesis.with_material(self.key, value)
        changed = [dict(values) for values in hypothesis.values]
        changed[self.effect][self.key] = value
        return replace(hypothesis, values=tuple(changed))


def free_parameters(
    hypothesis: Hypothesis, settings: FittingSettings = _USUAL
) -> tuple[HypothesisParameter, ...]:
    """Return the free parameters: E and ν first, unless they are given, then amplitudes and constants of each effect.

    ``settings`` tell how far a step may go.
    """
    found = [
        HypothesisParameter(
            name=one.name,
            unit=one.unit or "1",
            value=float(getattr(hypothesis, one.name)),
            transform=one.transform,
            lower=one.lower,
            upper=one.upper,
            prior=one.prior,
            longest_step=settings.longest_step,
            effect=None,
            key=one.name,
            step=_STEP_OF_MATERIAL,
        )
        for one in hypothesis.free_material
    ]
    for number, (effect, values) in enumerate(zip(hypothesis.effects, hypothesis.values, strict=True)):
        found += [_of_amplitude(number, effect, one, values[one.name], settings) for one in effect.amplitudes]
        found += [
            _of_constant(number, effect, one, values[one.name], settings)
            for one in effect.constants
            if not one.fixed
        ]
    return tuple(found)


def moved(hypothesis: Hypothesis, free: Sequence[HypothesisParameter], step: FloatArray) -> Hypothesis:
    """Return a hypothesis after a step (p,) of its internal variables."""
    for parameter, change in zip(free, step, strict=True):
        hypothesis = parameter.put(hypothesis, parameter.of(hypothesis).internal + float(change))
    return hypothesis


def _of_amplitude(
    number: int, effect: Effect, amplitude: Amplitude, value: float, settings: FittingSettings
) -> HypothesisParameter:
    return HypothesisParameter(
        name=f"{effect.name}.{amplitude.name}",
        unit=amplitude.unit,
        value=value,
        lower=amplitude.lower,
        upper=amplitude.upper,
        prior=NormalPrior(0.0, amplitude.scale),
        longest_step=settings.longest_in_scales * amplitude.scale,
        effect=number,
        key=amplitude.name,
        step=_step_of(effect) * amplitude.scale,
    )


def _of_constant(
    number: int, effect: Effect, constant: Constant, value: float, settings: FittingSettings
) -> HypothesisParameter:
    """A positive constant that spans decades is treated by its logarithm; the prior covers its range."""
    decades = constant.lower > 0 and constant.upper / constant.lower > 5
    transform = LOGARITHM if decades else IDENTITY
    width = transform.internal_of(constant.upper) - transform.internal_of(constant.lower)
    return HypothesisParameter(
        name=f"{effect.name}.{constant.name}",
        unit=constant.unit,
        value=value,
        transform=transform,
        lower=constant.lower,
        upper=constant.upper,
        prior=RangePrior(width),
        longest_step=settings.longest_of_a_range * width,
        effect=number,
        key=constant.name,
        step=_step_of(effect) * width,
    )


def _step_of(effect: Effect) -> float:
    """Return the step of its parameters as a share of their priors' width."""
    return _STEP_AT_THRESHOLDS if effect.at_thresholds else _STEP
