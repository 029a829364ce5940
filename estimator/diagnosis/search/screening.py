"""Effects screened to first order beside a solved hypothesis."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import Moments, moments_of
from estimator.diagnosis.evidence.floors import log_evidence, over_floors
from estimator.diagnosis.evidence.marginal_likelihood import (
    linear_model,
    price_of_choice,
    priors_within_a_step,
)
from estimator.diagnosis.evidence.signatures import Signature, signatures_of, which_remember
from estimator.diagnosis.fitting.case import Case, Linearisation, poses_apart
from estimator.diagnosis.fitting.releases import starts_at_full_size
from estimator.diagnosis.model.free_parameters import HypothesisParameter, moved
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Mechanics, Solution, at_few_poses, mechanics_of, solve_case
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.settings import SearchSettings
from estimator.effects.effect import Effect
from estimator.effects.shared.between_platens import is_pressed
from estimator.errors import SolverError
from estimator.inference.gauss_newton import step_of_gram

FloatArray = NDArray[np.float64]


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


def screen(context: Context, effects: Sequence[Effect]) -> list[Trial]:
    """Return the trials of all effects that can show at all their starts, the most probable first."""
    effects = [effect for effect in effects if can_show(effect, context)]
    jobs = [
        context.executor.submit(_signatures, context.case, context.baseline, share)
        for share in _shares(effects, context.settings.search)
    ]
    found: list[Trial] = []
    for done, job in enumerate(as_completed(jobs), start=1):
        found += trials_of(context, job.result())
        context.tell("screening the catalogue", done, len(jobs))
    return sorted(found, key=_descending)


def _descending(trial: Trial) -> float:
    return -trial.log_evidence


def can_show(effect: Effect, context: Context) -> bool:
    """Tell whether what an effect acts on is there: anchors, a table, plates, beads and experiments enough."""
    case = context.case
    enough = context.beads_seen >= max(effect.fewest_beads, 1 if effect.group == "vision" else 0)
    held = effect.group != "anchor" or bool(case.problem.anchored.any())
    lies = not effect.needs_table or case.experiments[0].environment.surface_below == "table"
    several = len(case.experiments) >= effect.fewest_experiments
    return held and lies and enough and several and is_of_this_rig(effect, case)


def is_of_this_rig(effect: Effect, case: Case) -> bool:
    """Tell whether an effect is asked about at all: what plates do is not where nothing is pressed between two."""
    return not effect.needs_platens or is_pressed(case.problem, case.experiments)


def labels_without_signature(context: Context, trials: Sequence[Trial]) -> tuple[str, ...]:
    """Return the labels that could show, and whose every form is without an equilibrium beside the baseline."""
    screened = {trial.signature.effect.label for trial in trials}
    could = (one.label for one in context.catalogue.effects if can_show(one, context))
    return tuple(dict.fromkeys(label for label in could if label not in screened))


def best_starts(trials: Sequence[Trial], of_searched: int) -> list[Trial]:
    """Return the best trial of each effect, sorted; so many where a search among constants may go astray."""
    tried: Counter[str] = Counter()
    found = []
    for trial in sorted(trials, key=_descending):
        effect = trial.signature.effect
        searched = any(not constant.fixed for constant in effect.constants)
        if tried[effect.name] < (of_searched if searched else 1):
            found.append(trial)
            tried[effect.name] += 1
    return found


def from_full_size(context: Context, trials: Sequence[Trial]) -> list[Trial]:
    """Return trials, the most probable first, that begin where what gives way leaves least at its full size.

    What does not come near the best place of its effect is left out.
    """
    tried = Counter(trial.signature.effect for trial in trials)
    jobs = {
        effect: context.executor.submit(starts_at_full_size, context.case, context.baseline, effect, count)
        for effect, count in tried.items()
        if effect.looked_over()
    }
    starts = {effect: iter(job.result()) for effect, job in jobs.items()}
    found = []
    for trial in trials:
        effect = trial.signature.effect
        start = next(starts[effect], None) if effect in starts else trial.start
        if start is not None:
            found.append(replace(trial, start=start))
    return found


def _shares(effects: Sequence[Effect], settings: SearchSettings) -> list[list[Effect]]:
    """Deal the effects out, the dearest first, each to the share with least to do.

    Those that set nodes free stay together: the tissue is condensed onto these once for all. So do those whose terms
    may remember, for which every load step is solved.
    """
    releasing = [one for one in effects if not one.keeps_pattern]
    with_terms = [one for one in effects if one.keeps_pattern and "terms" in one.acts_on]
    groups = [[one] for one in effects if one.keeps_pattern and "terms" not in one.acts_on]
    groups += [group for group in (releasing, with_terms) if group]
    shares: list[list[Effect]] = [[] for _ in range(settings.shares)]
    load = [0.0] * settings.shares
    cost = partial(_cost, condensing=settings.condensing)
    for group in sorted(groups, key=cost, reverse=True):
        least = load.index(min(load))
        shares[least] += group
        load[least] += cost(group)
    return [share for share in shares if share]


def _cost(group: Sequence[Effect], condensing: float) -> float:
    """Return roughly how long its signatures take."""
    cost = 0.0
    for effect in group:
        if not effect.acts_on_tissue:
            cost += 0.1
            continue
        starts = math.prod(max(len(constant.grid), 1) for constant in effect.constants)
        # what may remember goes by every load step, the others by those of a few poses
        cost += (6.0 if "terms" in effect.acts_on else 1.0) + 0.1 * starts
    return cost if all(effect.keeps_pattern for effect in group) else cost + condensing


def _signatures(case: Case, base: Linearisation, effects: Sequence[Effect]) -> list[Signature]:
    every, solver = poses_apart(case, base.hypothesis, ()), case.settings.solver
    remembering = which_remember(case, base.mechanics, base.hypothesis, effects)
    mechanics = [mechanics_of(one) for one in _solved_anew(case, base, every=1 if remembering else every)]
    found = _of_those_that_can_be(case, mechanics, base.hypothesis, remembering)
    # What remembers nothing is as well told from the states of a few poses.
    if every > 1:
        mechanics = [at_few_poses(one, every, solver.smooth_m) for one in mechanics]
    others = [effect for effect in effects if effect not in remembering]
    return found + _of_those_that_can_be(case, mechanics, base.hypothesis, others)


def _solved_anew(case: Case, base: Linearisation, every: int) -> list[Solution]:
    try:
        found = solve_case(case, base.hypothesis, base.known, every=every)
    except SolverError:
        found = solve_case(case, base.hypothesis, every=every)  # from rest, in shorter steps
    return found


def _of_those_that_can_be(
    case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis, effects: Sequence[Effect]
) -> list[Signature]:
    """Return the signatures of those effects that have one: a small change by the others has no equilibrium."""
    try:
        found = signatures_of(case, mechanics, hypothesis, effects)
    except SolverError:
        half = len(effects) // 2
        parts = (effects[:half], effects[half:]) if half else ()
        found = [one for part in parts for one in _of_those_that_can_be(case, mechanics, hypothesis, part)]
    return [one for one in found if all(np.isfinite(columns).all() for columns in one.columns)]


def trials_of(context: Context, signatures: Sequence[Signature], gain: float = -math.inf) -> list[Trial]:
    """Weigh signatures beside the solved hypothesis of a context, and return where their refits should begin.

    The most probable floor is enough for those far from the best, or from the ``gain`` in log evidence that is asked.
    """
    case, base, error, settings = context.case, context.baseline, context.error, context.settings
    roughly_alone = log_evidence(*linear_model(case, base, error), error, error.floor)
    alone = roughly_alone - price_of_choice(case, base.hypothesis)
    moments = moments_beside(context, signatures)
    own, at = list(range(1 + len(base.free_parameters))), 1 + len(base.free_parameters)
    known = []
    for signature in signatures:
        chosen = [*own, *range(at, at + len(signature.free_parameters))]
        at += len(signature.free_parameters)
        hypothesis, free = null_beside(base, signature)
        weighed = moments.among(chosen), priors_within_a_step(free, settings.evidence)
        price = price_of_choice(case, hypothesis)
        known.append((log_evidence(*weighed, error, error.floor) - price, price, hypothesis, free, weighed))
    best = max((roughly for roughly, *_ in known), default=0.0)
    least = max(best - settings.search.hopeless, alone + gain - settings.search.by_floors)
    found = []
    for signature, (roughly, price, hypothesis, free, weighed) in zip(signatures, known, strict=True):
        value = roughly if roughly < least else over_floors(*weighed, error) - price
        step = step_of_gram(weighed[0].gram, free).step
        found.append(Trial(signature, value, moved(hypothesis, free, step)))
    return found


def moments_beside(context: Context, signatures: Sequence[Signature]) -> Moments:
    """Return the moments of a solved hypothesis' residual, its derivatives, and signatures beside it, in this order."""
    base = context.baseline
    of_experiments = zip(base.residual, base.jacobian, range(len(base.residual)), strict=True)
    return moments_of(
        context.error,
        [np.column_stack([r, c, *(one.columns[n] for one in signatures)]) for r, c, n in of_experiments],
    )


def beside(base: Linearisation, signature: Signature) -> Linearisation:
    """Return the linearisation of a solved hypothesis with one effect more, at that effect's null."""
    columns = [np.column_stack(pair) for pair in zip(base.jacobian, signature.columns, strict=True)]
    hypothesis, free = null_beside(base, signature)
    return replace(base, hypothesis=hypothesis, free_parameters=free, jacobian=tuple(columns), next_share=1.0)


def null_beside(
    base: Linearisation, signature: Signature
) -> tuple[Hypothesis, tuple[HypothesisParameter, ...]]:
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


def leading_trials(trials: Sequence[Trial], none: float, settings: SearchSettings) -> list[Trial]:
    """Return the trials worth a refit: near the best, and not many forms of one label.

    One promising form is among them, however many lead it, of what sets in at thresholds: its derivative at the null
    does not have what it does beyond them.
    """
    least = max(-settings.strong, settings.promising * (trials[0].log_evidence - none))
    chosen: list[Trial] = []
    for trial in trials:
        label = trial.signature.effect.label
        forms = sum(one.signature.effect.label == label for one in chosen)
        gain = trial.log_evidence - none
        if gain < least and len(chosen) >= settings.fewest_candidates:
            break
        if forms < settings.forms_of_a_label:
            chosen.append(trial)
        if len(chosen) == settings.candidates:
            break
    taken = {one.signature.effect.label for one in chosen}
    return chosen + [
        trial
        for label, trial in best_trials(trials).items()
        if trial.signature.effect.at_thresholds and label not in taken and trial.log_evidence - none >= least
    ]
