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
    return signatures_at(case, mechanics, hypothesis, _plans(case, mechanics, hypothesis, effects))


def _plans(
    case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis, effects: Sequence[Effect]
) -> list[tuple[Effect, dict[str, float]]]:
    """Return effects with the constants at which each is looked for beside a solved hypothesis."""
    readings = [
        predicted_readings(one, hypothesis, correction)
        for one, correction in zip(mechanics, case.corrections, strict=True)
    ]
    return [(effect, constants) for effect in effects for constants in effect.starts(readings)]


def _null(
    case: Case, hypothesis: Hypothesis, effect: Effect, constants: Mapping[str, float]
) -> tuple[Hypothesis, tuple[HypothesisParameter, ...]]:
    """Return a hypothesis with one effect more, at its null, and that effect's amplitudes."""
    absent = {amplitude.name: 0.0 for amplitude in effect.amplitudes}
    null, number = hypothesis.with_effect(effect, {**constants, **absent}), len(hypothesis.effects)
    free = free_parameters(null, case.settings.fitting)
    return null, tuple(one for one in free if one.effect == number and one.key in absent)


def which_remember(
    case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis, effects: Sequence[Effect]
) -> list[Effect]:
    """Return the effects with which tissue beside a hypothesis depends on what went before, or on the time."""
    with_terms = [effect for effect in effects if "terms" in effect.acts_on]
    first = dict(reversed(_plans(case, mechanics, hypothesis, with_terms)))
    found = []
    for effect, constants in first.items():
        null, free = _null(case, hypothesis, effect, constants)
        if poses_apart(case, null, [one.put(null, one.step) for one in free]) == 1:
            found.append(effect)
    return found


def signatures_at(
    case: Case,
    mechanics: Sequence[Mechanics],
    hypothesis: Hypothesis,
    plans: Sequence[tuple[Effect, Mapping[str, float]]],
) -> list[Signature]:
    """Return the signatures of effects at given constants."""
    amplitudes: list[tuple[HypothesisParameter, ...]] = []
    perturbations: list[Perturbation] = []
    for effect, constants in plans:
        null, free = _null(case, hypothesis, effect, constants)
        amplitudes.append(free)
        perturbations += [Perturbation(c.name, c.put(null, c.step), effect, c.step) for c in free]
    columns = whitened_derivatives(case, mechanics, hypothesis, perturbations)
    found, at = [], 0
    for (effect, constants), free in zip(plans, amplitudes, strict=True):
        share = slice(at, at + len(free))
        found.append(Signature(effect, constants, free, tuple(block[:, share] for block in columns)))
        at += len(free)
    return found
