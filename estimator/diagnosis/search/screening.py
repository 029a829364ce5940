"""Effects screened to first order beside a solved hypothesis."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import ModelError, Moments, moments_of
from estimator.diagnosis.evidence.laplace import log_evidence, over_floors
from estimator.diagnosis.evidence.marginal_likelihood import (
    linear_model,
    price_of_choice,
    priors_within_a_step,
)
from estimator.diagnosis.evidence.signatures import Signature, signatures_of
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.fitting.gauss_newton import moved, step_of_gram
from estimator.diagnosis.model.free_parameters import FreeParameter
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.sensitivity.mechanical_changes import acts_on_tissue
from estimator.effects.effect import Effect

FloatArray = NDArray[np.float64]
Tell = Callable[[str, int, int], None]

_STARTS_TRIED = 2
# Every share of the catalogue solves the baseline anew, which costs as much as many effects do.
_SHARES = 2
# Condensing the tissue onto the nodes that some effects set free costs as much as this, where an effect costs one.
_CONDENSING = 20.0
# A trial this much below the best with the most probable floor is not weighed with the other floors; nor is one that
# falls short by this much of what is asked of it. The others have added 2.9 to what one gains at the most, on 9 cases.
_HOPELESS, _BY_FLOORS = 12.0, 6.0


@dataclass(frozen=True, eq=False)
class Trial:
    """A hypothesis to first order: the effect of a signature beside a solved hypothesis.

    Attributes
    ----------
    signature : of the effect
    log_evidence : over all floors of what every model misses
    start : where a refit should begin
    """

    signature: Signature
    log_evidence: float
    start: Hypothesis


def screen(
    case: Case,
    base: Linearisation,
    error: ModelError,
    effects: Sequence[Effect],
    executor: Executor,
    tell: Tell,
) -> list[Trial]:
    """Return the trials of all effects at all their starts, the most probable first."""
    jobs = [executor.submit(_signatures, case, base, share) for share in _shares(effects, _SHARES)]
    found: list[Trial] = []
    for done, job in enumerate(as_completed(jobs), start=1):
        found += trials_of(case, base, error, job.result())
        tell("screening the catalogue", done, len(jobs))
    return sorted(found, key=_descending)


def _descending(trial: Trial) -> float:
    return -trial.log_evidence


def best_starts(trials: Sequence[Trial]) -> list[Trial]:
    """Return the best trial of each effect, and the next ones where a search among constants may go astray, sorted."""
    tried: Counter[str] = Counter()
    found = []
    for trial in sorted(trials, key=_descending):
        effect = trial.signature.effect
        searched = any(not constant.fixed for constant in effect.constants)
        if tried[effect.name] < (_STARTS_TRIED if searched else 1):
            found.append(trial)
            tried[effect.name] += 1
    return found


def _shares(effects: Sequence[Effect], count: int) -> list[list[Effect]]:
    """Deal the effects out, the dearest first, each to the share with least to do.

    Those that set nodes free stay together: the tissue is condensed onto these once for all.
    """
    releasing = [effect for effect in effects if not effect.keeps_pattern]
    groups = [[effect] for effect in effects if effect.keeps_pattern] + ([releasing] if releasing else [])
    shares: list[list[Effect]] = [[] for _ in range(count)]
    load = [0.0] * count
    for group in sorted(groups, key=_cost, reverse=True):
        least = load.index(min(load))
        shares[least] += group
        load[least] += _cost(group)
    return [share for share in shares if share]


def _cost(group: Sequence[Effect]) -> float:
    """Return roughly how long its signatures take."""
    cost = 0.0
    for effect in group:
        if not acts_on_tissue(effect):
            cost += 0.1
            continue
        starts = math.prod(max(len(constant.grid), 1) for constant in effect.constants)
        cost += 1.0 + 0.1 * starts + (4.0 if effect.rate_dependent else 0.0)
    return cost if group[0].keeps_pattern else cost + _CONDENSING


def _signatures(case: Case, base: Linearisation, effects: Sequence[Effect]) -> list[Signature]:
    solutions = solve_case(case.problem, case.experiments, base.hypothesis, case.loads, base.known)
    mechanics = [mechanics_of(solution) for solution in solutions]
    return signatures_of(case, mechanics, base.hypothesis, effects)


def trials_of(
    case: Case,
    base: Linearisation,
    error: ModelError,
    signatures: Sequence[Signature],
    gain: float = -math.inf,
) -> list[Trial]:
    """Weigh signatures beside a solved hypothesis, and return where their refits should begin.

    The most probable floor is enough for those far from the best, or from the ``gain`` in log evidence that is asked.
    """
    alone = log_evidence(*linear_model(base, error), error, error.floor) - price_of_choice(
        case, base.hypothesis
    )
    moments = moments_beside(base, error, signatures)
    own, at = list(range(1 + len(base.free_parameters))), 1 + len(base.free_parameters)
    known = []
    for signature in signatures:
        chosen = [*own, *range(at, at + len(signature.free_parameters))]
        at += len(signature.free_parameters)
        hypothesis, free = null_beside(base, signature)
        weighed = moments.among(chosen), priors_within_a_step(hypothesis, free)
        price = price_of_choice(case, hypothesis)
        known.append((log_evidence(*weighed, error, error.floor) - price, price, hypothesis, free, weighed))
    best = max((roughly for roughly, *_ in known), default=0.0)
    found = []
    for signature, (roughly, price, hypothesis, free, weighed) in zip(signatures, known, strict=True):
        hopeless = roughly < max(best - _HOPELESS, alone + gain - _BY_FLOORS)
        value = roughly if hopeless else over_floors(*weighed, error) - price
        step, _ = step_of_gram(weighed[0].gram, hypothesis, free)
        found.append(Trial(signature, value, moved(hypothesis, free, step)))
    return found


def moments_beside(base: Linearisation, error: ModelError, signatures: Sequence[Signature]) -> Moments:
    """Return the moments of a fit's residual, of its derivatives and of signatures beside it, in this order."""
    of_experiments = zip(base.residual, base.jacobian, range(len(base.residual)), strict=True)
    return moments_of(
        error,
        [np.column_stack([r, c, *(one.columns[n] for one in signatures)]) for r, c, n in of_experiments],
    )


def beside(base: Linearisation, signature: Signature) -> Linearisation:
    """Return the linearisation of a solved hypothesis with one effect more, at that effect's null."""
    columns = [np.column_stack(pair) for pair in zip(base.jacobian, signature.columns, strict=True)]
    hypothesis, free = null_beside(base, signature)
    return replace(base, hypothesis=hypothesis, free_parameters=free, jacobian=tuple(columns), next_share=1.0)


def null_beside(base: Linearisation, signature: Signature) -> tuple[Hypothesis, tuple[FreeParameter, ...]]:
    """Return a solved hypothesis with one effect more, at its null, and what is free of it."""
    number = len(base.hypothesis.effects)
    free = (*base.free_parameters, *(replace(c, effect=number) for c in signature.free_parameters))
    null = base.hypothesis.with_effect(
        signature.effect, {**signature.constants, **{a.name: 0.0 for a in signature.effect.amplitudes}}
    )
    return null, free


def best_trials(trials: Sequence[Trial]) -> Mapping[str, Trial]:
    """Return the best trial of each label."""
    found: dict[str, Trial] = {}
    for trial in trials:
        label = trial.signature.effect.label
        if label not in found or trial.log_evidence > found[label].log_evidence:
            found[label] = trial
    return found
