"""Every effect of the catalogue at once, to first order, from the fitted baseline.

One linearisation a start: the derivative of all channels by the amplitudes at their null. A start is what the effect's
constants begin from, a relaxation time or a place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.fitting.case import Case, poses_apart, whitened_derivatives
from estimator.diagnosis.model.free_parameters import HypothesisParameter, free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Mechanics
from estimator.diagnosis.sensitivity.perturbation import Perturbation
from estimator.diagnosis.sensitivity.readings import predicted_readings
from estimator.effects.effect import Effect

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Signature:
    """What an effect would do, to first order.

    Attributes
    ----------
    effect : Effect
    constants : its constants
    free_parameters : of its amplitudes
    columns : for each experiment (r, k), whitened derivative by each amplitude
    """

    effect: Effect
    constants: Mapping[str, float]
    free_parameters: tuple[HypothesisParameter, ...]
    columns: tuple[FloatArray, ...]


def signatures_of(
    case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis, effects: Sequence[Effect]
) -> list[Signature]:
    """Return the signatures of every start of the given effects beside a solved hypothesis."""
    readings = [
        predicted_readings(one, hypothesis, correction)
        for one, correction in zip(mechanics, case.corrections, strict=True)
    ]
    plans = [(effect, constants) for effect in effects for constants in effect.starts(readings)]
    return signatures_at(case, mechanics, hypothesis, plans)


def remembers(case: Case, hypothesis: Hypothesis, effect: Effect) -> bool:
    """Tell whether tissue with an effect beside a hypothesis depends on what went before, or on the time."""
    constants = {
        one.name: one.grid[0] if one.grid else (one.lower + one.upper) / 2 for one in effect.constants
    }
    null = hypothesis.with_effect(effect, {**constants, **{one.name: 0.0 for one in effect.amplitudes}})
    free = (
        one for one in free_parameters(null, case.settings.fitting) if one.effect == len(hypothesis.effects)
    )
    return poses_apart(case, [one.put(null, one.step) for one in free]) == 1


def signatures_at(
    case: Case,
    mechanics: Sequence[Mechanics],
    hypothesis: Hypothesis,
    plans: Sequence[tuple[Effect, Mapping[str, float]]],
) -> list[Signature]:
    """Return the signatures of effects at given constants."""
    number = len(hypothesis.effects)
    amplitudes: list[tuple[HypothesisParameter, ...]] = []
    perturbations: list[Perturbation] = []
    for effect, constants in plans:
        absent = {amplitude.name: 0.0 for amplitude in effect.amplitudes}
        null = hypothesis.with_effect(effect, {**constants, **absent})
        everything = free_parameters(null, case.settings.fitting)
        free = tuple(c for c in everything if c.effect == number and c.key in absent)
        amplitudes.append(free)
        perturbations += [Perturbation(c.name, c.put(null, c.step), effect, c.step) for c in free]
    columns = whitened_derivatives(case, mechanics, hypothesis, perturbations)
    found, at = [], 0
    for (effect, constants), free in zip(plans, amplitudes, strict=True):
        share = slice(at, at + len(free))
        found.append(Signature(effect, constants, free, tuple(block[:, share] for block in columns)))
        at += len(free)
    return found
