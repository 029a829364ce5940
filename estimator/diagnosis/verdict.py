"""The verdict on a field of hypotheses: which cause, or which two, whether none or something unknown beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.contest import (
    Contender,
    Tell,
    best_starts,
    evidence_of_unknown,
    first_order_evidence,
    trials_of,
)
from estimator.diagnosis.field import Field
from estimator.diagnosis.findings import best_trials
from estimator.diagnosis.held_out import lost_on_held_out, white_floor
from estimator.diagnosis.hypothesis import Hypothesis, negligible_effects
from estimator.diagnosis.judgement import (
    LOG_PRIOR_OF_A_PAIR,
    best_of,
    log_priors,
    probabilities,
    shared_with_unknown,
)
from estimator.diagnosis.noise import robust_deviation
from estimator.diagnosis.race import race
from estimator.diagnosis.result import NONE, UNKNOWN
from estimator.effects.catalogue import LABELS
from estimator.effects.effect import Group

FloatArray = NDArray[np.float64]

# Signatures are inexact, so that evidences of hundreds overstate what they say.
TEMPER = 0.5
# An effect of negligible size is believed where it raises the log evidence by this: two good solvers of one baseline,
# at the largest forces, differed by 17 in what a little stiffening or a grasp 0.1 mm aside would explain.
_BELIEVED = 25.0
# What a sensor does to its readings no error of the mesh can feign; on clean cases it raised the log evidence by 1.
_BELIEVED_OF_SENSORS = 8.0
_SENSORS: frozenset[Group] = frozenset({"force", "timing", "vision"})
# What an effect of negligible size falls short of none.
_NEGLIGIBLE = 5.0
# A second cause must raise the log evidence by this, beyond its prior: less than that the baseline's own error feigns.
_SECOND_CAUSE = 15.0
# Something unknown beside the causes must do so too, and by this share of what they do: a form that is nearly right
# leaves a little of a large gap.
_REMAINDER = 0.05
# A remainder that is not smooth, such as that of a few beads, must exceed the scatter of chi-squared by so much: right
# causes leave up to 5, by outliers and by noise that is not quite what was stated.
_ROUGH_SIGMA = 8.0
# And without any cause, so much beyond the noise that most of the residuals show.
_TAIL_SIGMA = 4.0
_LEADERS, _PARTNERS = 2, 3
# One effect without a label is as improbable beforehand as one with, and so less probable than all that is unknown.
_PRIORS = log_priors(LABELS)
_PRICE_OF_OUTSIDER = _PRIORS[UNKNOWN] - float(np.mean([_PRIORS[label] for label in LABELS]))


@dataclass(frozen=True)
class Verdict:
    """What is concluded.

    Attributes
    ----------
    labels : of the causes, the leading one first, "unknown" among them where something without a label is one, or more
        remains than they explain; empty for none
    winner : the hypothesis with those causes; None for none, and for an unknown that was not recognised
    probability : of every answer, the most probable first
    """

    labels: tuple[str, ...]
    winner: Contender | None
    probability: Mapping[str, float]


def reach_verdict(field: Field, evidence: Mapping[str, float], executor: Executor, tell: Tell) -> Verdict:
    """Conclude from the log evidence of every answer; look for a second cause, and for what the causes leave."""
    probability = probabilities(evidence, LABELS, TEMPER)
    leading = next(iter(probability))
    if leading == NONE:
        beyond = rough_gap(field.baseline.residual, white_floor(field.case))
        if not beyond:
            return Verdict((), None, probability)
        return Verdict((UNKNOWN,), None, shared_with_unknown(probability, NONE, 0.0, beyond))
    outsider = _first_of(field, UNKNOWN) if evidence[UNKNOWN] > field.unknown else None
    recognised = outsider if leading == UNKNOWN else None
    best = recognised or _first_of(field, next(label for label in probability if label in LABELS))
    if best is None:
        return Verdict((UNKNOWN,), None, probability)
    pair = _best_pair(field, best, executor, tell)
    if pair is not None and pair.log_evidence > field.unknown + _SECOND_CAUSE:
        stronger = max(pair.labels, key=lambda label: evidence[label])
        evidence = {**evidence, stronger: max(evidence[stronger], pair.log_evidence)}
        return _with_remainder(field, pair, stronger, probabilities(evidence, LABELS, TEMPER))
    if leading == UNKNOWN:
        return Verdict((UNKNOWN,), recognised, probability)
    return _with_remainder(field, best, leading, probability)


def weigh(field: Field) -> dict[str, float]:
    """Return the log evidence of every answer.

    An effect smaller than anybody would care for is no gap: its evidence counts for none, unless it is so strong that
    no inexactness of the baseline could feign it; the nearer it comes to that, the more of it the effect keeps. An
    effect that makes the prediction of left-out experiments worse loses by as much.
    """
    refitted = {one.fit.hypothesis.effects[0].name for one in field.contenders}
    points = [
        (one.fit.hypothesis, one.log_evidence - lost_on_held_out(one.fit, field.baseline))
        for one in field.contenders
    ]
    points += [
        (trial.start, trial.log_evidence)
        for trial in best_starts(field.trials)
        if trial.signature.effect.name not in refitted
    ]
    slight = [(hypothesis, value) for hypothesis, value in points if _slight(hypothesis, value - field.none)]
    forms = best_of(
        [
            (hypothesis.effects[0].label, value)
            for hypothesis, value in points
            if not _slight(hypothesis, value - field.none)
        ]
    )
    found = {**dict.fromkeys(LABELS, field.none - _NEGLIGIBLE), **forms}
    for hypothesis, value in slight:
        label, gain = hypothesis.effects[0].label, value - field.none
        if label != UNKNOWN and gain > 0.0:
            found[label] = max(found[label], field.none + _doubted(gain, _bar(hypothesis)))
    found[NONE] = max([field.none, *(value for _, value in slight)])
    found[UNKNOWN] = max(field.unknown, forms.get(UNKNOWN, -np.inf) - _PRICE_OF_OUTSIDER)
    return found


def _doubted(gain: float, bar: float) -> float:
    """Return what an effect of negligible size keeps of its gain: little of a small one, all where it is at the bar."""
    share = gain / bar
    return share * gain - (1.0 - share) * _NEGLIGIBLE


def _first_of(field: Field, label: str) -> Contender | None:
    """Return the best contender with a label."""
    return next((one for one in field.contenders if one.labels[0] == label), None)


def _slight(hypothesis: Hypothesis, gain: float) -> bool:
    """Tell whether a hypothesis has an effect of negligible size that a slight error of the model could feign."""
    return gain < _bar(hypothesis)


def _bar(hypothesis: Hypothesis) -> float:
    """Return how much evidence no slight error of the model could feign; -inf without an effect of negligible size."""
    return max(
        (
            _BELIEVED_OF_SENSORS if effect.group in _SENSORS else _BELIEVED
            for effect in negligible_effects(hypothesis)
        ),
        default=-np.inf,
    )


def _with_remainder(
    field: Field, winner: Contender, leading: str, probability: Mapping[str, float]
) -> Verdict:
    """Return the verdict for a hypothesis, with "unknown" in it where something more stands out beside its causes."""
    labels = (leading, *(label for label in winner.labels if label != leading))
    if UNKNOWN in labels:
        return Verdict(labels, winner, probability)
    smooth = evidence_of_unknown(winner.fit, field.error) - winner.log_evidence
    beyond = max(smooth, rough_remainder(winner.fit.residual, white_floor(field.case)))
    explained = winner.log_evidence - field.none
    if beyond < max(_SECOND_CAUSE, _REMAINDER * explained):
        return Verdict(labels, winner, probability)
    shared = shared_with_unknown(probability, leading, explained, beyond)
    if next(iter(shared)) == UNKNOWN:
        return Verdict((UNKNOWN,), None, shared)
    return Verdict((*labels, UNKNOWN), winner, shared)


def rough_remainder(residual: Sequence[FloatArray], floor: float) -> float:
    """Return half of what the whitened residuals' sum of squares has beyond noise, where that stands out; else 0.

    Parameters
    ----------
    residual : (r,) of each experiment
    floor : root mean square of noise alone
    """
    values = np.concatenate(list(residual))
    excess = _deviations_beyond(values, floor)
    return excess * floor**2 * float(np.sqrt(len(values) / 2.0)) if excess > _ROUGH_SIGMA else 0.0


def rough_gap(residual: Sequence[FloatArray], floor: float) -> float:
    """Return the rough remainder of a baseline; 0 where its noise was merely understated: most residuals show that.

    Parameters
    ----------
    residual, floor : as in :func:`rough_remainder`
    """
    values = np.concatenate(list(residual))
    usual = max(floor, robust_deviation(values))
    return rough_remainder(residual, floor) if _deviations_beyond(values, usual) > _TAIL_SIGMA else 0.0


def _deviations_beyond(values: FloatArray, noise: float) -> float:
    """Return by how many of its deviations the sum of squares is beyond that of white noise."""
    return float((values @ values / noise**2 - len(values)) / np.sqrt(2.0 * len(values)))


def _best_pair(field: Field, best: Contender, executor: Executor, tell: Tell) -> Contender | None:
    """Return the best hypothesis with a second cause beside a leader, None where none is worth it."""
    starts = []
    for leader in field.contenders[:_LEADERS]:
        # Every start is weighed anew: where the leader's gap is large, a second cause seemed to lie elsewhere.
        others = [
            trial.signature for trial in field.trials if trial.signature.effect.label not in leader.labels
        ]
        tried = trials_of(field.case, leader.fit, field.error, others)
        beside = list(best_trials(tried).values())
        beside.sort(key=lambda trial: -trial.log_evidence)
        alone = first_order_evidence(field.case, leader.fit, field.error)
        starts += [
            (trial.log_evidence - alone + leader.log_evidence, trial.start)
            for trial in beside[:_PARTNERS]
            if trial.log_evidence > alone + _SECOND_CAUSE
        ]
    # One that would not even reach the best single cause is no pair, however much its own leader leaves.
    starts = [start for start in starts if start[0] > best.log_evidence]
    starts.sort(key=lambda item: -item[0])
    if not starts:
        return None
    begun = [start for _, start in starts[:_PARTNERS]]
    pairs = race(field.case, field.baseline, field.error, begun, best.log_evidence, executor, tell)
    pairs = [
        one
        for one in pairs
        if not _slight(one.fit.hypothesis, one.log_evidence - best.log_evidence)
        and not lost_on_held_out(one.fit, field.baseline)
    ]
    if not pairs or pairs[0].log_evidence + LOG_PRIOR_OF_A_PAIR < best.log_evidence + _SECOND_CAUSE:
        return None
    return pairs[0]
