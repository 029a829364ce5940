"""The diagnosis as a whole: where the gap lies, which effect causes it, how far it shrinks with it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from estimator.diagnosis.advice import advise
from estimator.diagnosis.case import Case, Linearisation, deformed_mesh
from estimator.diagnosis.considering import consider
from estimator.diagnosis.contest import (
    Contender,
    Tell,
    Trial,
    baseline_error,
    best_starts,
    evidence_of_unknown,
    first_order_evidence,
    parameter_deviations,
    polish_all,
    refit_all,
    screen,
    trial_of,
)
from estimator.diagnosis.discrepancy import ModelError
from estimator.diagnosis.findings import (
    absent_finding,
    best_trials,
    material_quantities,
    present_finding,
)
from estimator.diagnosis.glitches import number_left_out
from estimator.diagnosis.held_out import gap_of, gaps_by_kind, held_out_residuals, noise_floor, white_floor
from estimator.diagnosis.hypothesis import Hypothesis, negligible
from estimator.diagnosis.judgement import LOG_PRIOR_OF_A_PAIR, best_of, credible_set, probabilities
from estimator.diagnosis.multiplicity import Multiplicity, multiplicity_of
from estimator.diagnosis.preparation import prepare
from estimator.diagnosis.result import NONE, UNKNOWN, Diagnosis, EffectFinding, Material, Trace
from estimator.diagnosis.sentences import what_cannot_be_told
from estimator.diagnosis.where import where_of
from estimator.effects.catalogue import CATALOGUE, LABELS
from estimator.effects.effect import Effect
from estimator.experiment import Experiment
from estimator.workers import worker_pool

FloatArray = NDArray[np.float64]

# Signatures are inexact, so that evidences of hundreds overstate what they say.
TEMPER = 0.5
_CONTENDERS = 7
_POLISHED = 3
_FORMS_OF_A_LABEL = 3
# A hypothesis whose first-order evidence is this much below the best is not refitted, unless few are left.
_HOPELESS = 0.35
_PARTNERS = 3
# Contenders this close to the best, or within this share of its gain, are polished.
_CLOSE, _CLOSE_SHARE = 10.0, 0.15
# An effect of negligible size is believed where it raises the log evidence by this: two good solvers of one baseline,
# at the largest forces, differed by 17 in what a little stiffening or a grasp 0.1 mm aside would explain.
_BELIEVED = 25.0
# What an effect of negligible size falls short of none.
_NEGLIGIBLE = 5.0
# A second cause must raise the log evidence by this, beyond its prior: less than that the baseline's own error feigns.
_SECOND_CAUSE = 15.0


@dataclass(frozen=True)
class _Field:
    """What the contest has produced."""

    case: Case
    glitches: int
    baseline: Linearisation
    error: ModelError
    trials: tuple[Trial, ...]
    contenders: tuple[Contender, ...]
    evidence: Mapping[str, float]


def diagnose(experiments: Sequence[Experiment], progress: Tell | None = None) -> Diagnosis:
    """Diagnose the gap between the baseline and the experiments of one phantom in one mounting.

    Parameters
    ----------
    experiments : with the same phantom, anchors, grasp and fiducials
    progress : told what is being done, and how much of it is done

    Raises
    ------
    InputError
        The phantom cannot be meshed.
    FitError
        The baseline cannot be fitted.
    SolverError
        The baseline has no equilibrium.
    """
    started = time.perf_counter()
    tell = progress or (lambda stage, done, total: None)
    with worker_pool() as executor:
        field = _contest(experiments, executor, tell)
        winner, probability = _winner(field, executor, tell)
        return _diagnosis(field, winner, probability, started, executor, tell)


def _contest(experiments: Sequence[Experiment], executor: Executor, tell: Tell) -> _Field:
    tell("fitting the baseline", 0, 1)
    case, baseline = prepare(experiments, executor)
    tell("fitting the baseline", 1, 1)
    error = baseline_error(case, baseline)
    evidence = {
        NONE: first_order_evidence(case, baseline, error),
        UNKNOWN: evidence_of_unknown(baseline, error),
    }
    plain = [effect for effect in CATALOGUE if not effect.elaborates]
    trials = screen(case, baseline, error, plain, executor, tell)
    leaders = _leaders(best_starts(trials), evidence[NONE])
    contenders = refit_all(case, baseline, error, [trial.start for trial in leaders], executor, tell)
    close = _close(contenders, evidence[NONE])
    polished = polish_all(case, baseline, error, close, executor, tell)
    rest = contenders[len(close) :]
    more: list[Trial] = []
    doubtful = _doubtful(case, polished)
    if doubtful:
        elaborate = _elaborations(doubtful)
        finer = screen(case, baseline, error, elaborate, executor, tell) if elaborate else []
        more = best_starts(finer) + _siblings(best_starts(trials), doubtful[:1], contenders)
        trials += finer
    if more:
        refitted = refit_all(case, baseline, error, [t.start for t in more[:4]], executor, tell)
        better = [one for one in refitted if one.log_evidence > polished[0].log_evidence]
        polished += polish_all(case, baseline, error, better[:2], executor, tell)
        rest += [one for one in refitted if one not in better]
    contenders = sorted([*polished, *rest], key=lambda one: -one.log_evidence)
    weighed = weigh(evidence, contenders, best_starts(trials))
    left_out = number_left_out(experiments, case.experiments)
    return _Field(case, left_out, baseline, error, tuple(trials), tuple(contenders), weighed)


def weigh(
    evidence: Mapping[str, float], contenders: Sequence[Contender], trials: Sequence[Trial]
) -> dict[str, float]:
    """Return the evidence of every answer.

    An effect smaller than anybody would care for is no gap: its evidence counts for none, unless it is so strong that
    no inexactness of the baseline could feign it.
    """
    none = evidence[NONE]
    refitted = {one.fit.hypothesis.effects[0].name for one in contenders}
    points = [(one.fit.hypothesis, one.log_evidence) for one in contenders]
    points += [
        (trial.start, trial.log_evidence) for trial in trials if trial.signature.effect.name not in refitted
    ]
    slight = [value for hypothesis, value in points if _slight(hypothesis, value - none)]
    forms = [
        (hypothesis.effects[0].label, value)
        for hypothesis, value in points
        if not _slight(hypothesis, value - none)
    ]
    found = {**dict.fromkeys(LABELS, none - _NEGLIGIBLE), **evidence, **best_of(forms)}
    found[NONE] = max([none, *slight])
    return found


def _slight(hypothesis: Hypothesis, gain: float) -> bool:
    """Tell whether a hypothesis has an effect of negligible size that a slight error of the model could feign."""
    return negligible(hypothesis) and gain < _BELIEVED


def _close(contenders: Sequence[Contender], none: float) -> list[Contender]:
    """Return the contenders that a better fit could still bring to the front, of many the first."""
    if not contenders:
        return []
    best = contenders[0].log_evidence
    margin = max(_CLOSE, _CLOSE_SHARE * (best - none))
    return [one for one in contenders[:_POLISHED] if one.log_evidence > best - margin]


def _leaders(trials: Sequence[Trial], none: float) -> list[Trial]:
    """Return the trials worth a refit: near the best, and not many forms of one label."""
    best = trials[0].log_evidence - none
    chosen: list[Trial] = []
    for trial in trials:
        label = trial.signature.effect.label
        forms = sum(one.signature.effect.label == label for one in chosen)
        gain = trial.log_evidence - none
        if gain < max(-3.0, _HOPELESS * best) and len(chosen) >= _PARTNERS:
            break
        if forms < _FORMS_OF_A_LABEL:
            chosen.append(trial)
        if len(chosen) == _CONTENDERS:
            break
    return chosen


def _doubtful(case: Case, polished: Sequence[Contender]) -> list[Contender]:
    """Return the contenders of which a finer form could win: rivals close to the best, or what leaves a misfit."""
    if not polished:
        return []
    best = polished[0].log_evidence
    rivals = [one for one in polished if one.log_evidence > best - _CLOSE]
    if len({one.labels[0] for one in rivals}) > 1:
        return rivals
    return [] if _adequate(case, polished[0]) else list(polished[:2])


def _adequate(case: Case, contender: Contender) -> bool:
    """Tell whether a contender leaves no more than noise, so that no finer form of it is called for."""
    values = sum(len(residual) for residual in contender.fit.residual)
    return contender.fit.chi2 < values * white_floor(case) ** 2 + 3 * np.sqrt(2 * values)


def _elaborations(contenders: Sequence[Contender]) -> list[Effect]:
    """Return the finer forms of the leaders' labels."""
    labels = {one.labels[0] for one in contenders}
    return [effect for effect in CATALOGUE if effect.elaborates and effect.label in labels]


def _siblings(
    trials: Sequence[Trial], leading: Sequence[Contender], contenders: Sequence[Contender]
) -> list[Trial]:
    """Return the trials of the leader's label whose forms have not been refitted."""
    done = {one.fit.hypothesis.effects[0].name for one in contenders}
    labels = {one.labels[0] for one in leading}
    return [
        trial
        for trial in trials
        if trial.signature.effect.label in labels and trial.signature.effect.name not in done
    ]


def _winner(field: _Field, executor: Executor, tell: Tell) -> tuple[Contender | None, dict[str, float]]:
    """Return the hypothesis of the verdict, None for none or unknown, and the probability of every answer."""
    probability = probabilities(field.evidence, LABELS, TEMPER)
    leading = next(iter(probability))
    contested = {one.labels[0] for one in field.contenders}
    if leading == NONE or _first_label(probability) not in contested:
        return None, probability
    best = next(one for one in field.contenders if one.labels[0] == _first_label(probability))
    pair = _best_pair(field, best, executor, tell)
    if pair is not None and pair.log_evidence > field.evidence[UNKNOWN] + _SECOND_CAUSE:
        evidence = dict(field.evidence)
        leader = _stronger(field, pair)
        evidence[leader] = max(evidence[leader], pair.log_evidence)
        return pair, probabilities(evidence, LABELS, TEMPER)
    return (None if leading == UNKNOWN else best), probability


def _first_label(probability: Mapping[str, float]) -> str:
    """Return the most probable label of the catalogue."""
    return next(label for label in probability if label in LABELS)


def _stronger(field: _Field, pair: Contender) -> str:
    """Return the label of a pair that explains more alone."""
    return max(pair.labels, key=lambda label: field.evidence[label])


def _best_pair(field: _Field, best: Contender, executor: Executor, tell: Tell) -> Contender | None:
    """Return the best hypothesis with a second cause beside a leader, None where none is worth it."""
    starts = []
    for leader in field.contenders[:2]:
        # Every start is weighed anew: where the leader's gap is large, a second cause seemed to lie elsewhere.
        tried = [
            trial_of(field.case, leader.fit, field.error, trial.signature)
            for trial in field.trials
            if trial.signature.effect.label not in leader.labels
        ]
        beside = list(best_trials(tried).values())
        beside.sort(key=lambda trial: -trial.log_evidence)
        alone = first_order_evidence(field.case, leader.fit, field.error)
        starts += [
            (trial.log_evidence - alone + leader.log_evidence, trial.start)
            for trial in beside[:3]
            if trial.log_evidence > alone + _SECOND_CAUSE
        ]
    starts.sort(key=lambda item: -item[0])
    if not starts:
        return None
    pairs = refit_all(
        field.case,
        field.baseline,
        field.error,
        [start for _, start in starts[:_PARTNERS]],
        executor,
        tell,
    )
    pairs = polish_all(field.case, field.baseline, field.error, pairs[:2], executor, tell)
    pairs = [one for one in pairs if not _slight(one.fit.hypothesis, one.log_evidence - best.log_evidence)]
    if not pairs or pairs[0].log_evidence + LOG_PRIOR_OF_A_PAIR < best.log_evidence + _SECOND_CAUSE:
        return None
    return pairs[0]


def _diagnosis(
    field: _Field,
    winner: Contender | None,
    probability: Mapping[str, float],
    started: float,
    executor: Executor,
    tell: Tell,
) -> Diagnosis:
    case, baseline = field.case, field.baseline
    chosen = winner.fit if winner is not None else baseline
    leading = next(iter(probability))
    verdict = winner.labels if winner is not None else (() if leading == NONE else (UNKNOWN,))
    before, after = held_out_residuals(baseline), held_out_residuals(chosen)
    floor = noise_floor(
        case, (winner or field.contenders[0]).fit if field.contenders else baseline, field.error
    )
    gap = gap_of(before, after, floor)
    multiplicity = multiplicity_of(baseline, field.trials, field.error)
    effects = _findings(field, winner, probability, floor, multiplicity)
    catalogue_only = {label: field.evidence[label] for label in LABELS if label in field.evidence}
    shares = softmax(TEMPER * np.array(list(catalogue_only.values())))
    where = where_of(
        case, baseline, probability, dict(zip(catalogue_only, shares, strict=True)), LABELS, winner
    )
    alone = parameter_deviations(baseline, field.error, field.error.floor)
    incomplete = winner is not None and field.evidence[UNKNOWN] > winner.log_evidence
    credible = credible_set(probability)
    return Diagnosis(
        verdict=tuple(verdict),
        incomplete=incomplete,
        probabilities=probability,
        credible_set=credible,
        chance=multiplicity.chance,
        effects=effects,
        gap=gap,
        by_channel=gaps_by_kind(case, before, after, floor),
        by_experiment={
            experiment.name: gap_of([one], [two], floor)
            for experiment, one, two in zip(case.experiments, before, after, strict=True)
        },
        where=where,
        before=_material(baseline, alone),
        after=_material(chosen, alone if winner is None else winner.deviations),
        cannot_tell=what_cannot_be_told(effects, credible),
        next_experiment=advise(case, baseline, best_trials(field.trials), probability, executor, tell),
        glitches=field.glitches,
        traces=tuple(
            Trace(experiment, one, two, whitening.deviation, deformed_mesh(case, baseline, number))
            for number, (experiment, one, two, whitening) in enumerate(
                zip(case.experiments, baseline.predicted, chosen.predicted, case.whitenings, strict=True)
            )
        ),
        considered=consider(case, baseline, field.error, field.trials, field.contenders, floor),
        seconds=time.perf_counter() - started,
    )


def _material(fit: Linearisation, deviations: FloatArray) -> Material:
    return Material(**material_quantities(fit.hypothesis, fit.coordinates, deviations))


def _findings(
    field: _Field,
    winner: Contender | None,
    probability: Mapping[str, float],
    floor: float,
    multiplicity: Multiplicity,
) -> dict[str, EffectFinding]:
    fit = winner.fit if winner is not None else field.baseline
    found = {}
    for label, trial in best_trials(field.trials).items():
        if winner is not None and label in winner.labels:
            without = _without(field, winner, label)
            closure = gap_of(
                held_out_residuals(without), held_out_residuals(winner.fit), floor
            ).closure_held_out
            found[label] = present_finding(
                winner,
                winner.labels.index(label),
                probability[label],
                without.chi2 - winner.fit.chi2,
                closure if np.isfinite(closure) else None,
            )
        else:
            found[label] = absent_finding(trial, fit, probability[label], multiplicity)
    return found


def _without(field: _Field, winner: Contender, label: str) -> Linearisation:
    """Return the fit with the other causes of the verdict alone, the baseline where there is none."""
    others = tuple(other for other in winner.labels if other != label)
    alone = (one.fit for one in field.contenders if one.labels == others)
    return next(alone, field.baseline)
