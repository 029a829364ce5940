"""Where two causes may be at work: what one leaves for another beside it, and what two explain together."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from estimator.diagnosis.evidence.discrepancy import ModelError
from estimator.diagnosis.evidence.marginal_likelihood import evidence_of_unknown, first_order_evidence
from estimator.diagnosis.evidence.noise_floor import white_floor
from estimator.diagnosis.evidence.posterior import LOG_PRIOR_OF_A_PAIR
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.labels import UNKNOWN
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.pair_screening import Start, likeliest_pairs
from estimator.diagnosis.search.screening import Trial, best_trials, trials_of
from estimator.effects.catalogue import LABELS

# Refits of 36 pairs on 9 cases raised it by 0.4 more than first order promises at the most, often by less.
_PROMISED = 1.0
# Something unknown beside the causes must raise the log evidence by this, and by this share of what they do: any form
# that is nearly right leaves a little of a large gap.
_LEAST_REMAINDER, _REMAINDER = 15.0, 0.05
# Where something unknown beside a cause raises the log evidence by less than this, the cause leaves no more than noise.
_LEAVES = 3.0
# A second effect of a leader's own label that promises to raise it by this asks for a finer form of the leader.
_FINER_FORM = 4.0
# How many second causes are refitted beside each leader, how many pairs that were weighed together, and how many of
# both: as many as two workers do in two turns.
_PARTNERS, _PAIRS, _STARTS = 3, 2, 4
# One that promises less than the best by more than this, and by this share of what that adds to one cause, is left out.
_BEHIND, _BEHIND_SHARE = 10.0, 0.2
# Two causes that promise less than the best single one by more than this share of what that explains begin in another
# hollow of the misfit: beside glue that failed under way, six such pairs ended 20 000 in log evidence below. Of pairs
# that were there none promised less by more than .05 of it, on 34 cases.
_ANOTHER_HOLLOW = 0.2
# A refit keeps at most so many times what first order promises: of eight pairs that were there, 1.4 times.
_KEPT = 2.0
# Beside two causes that are there the errors that rows share leave up to 350 in log density. Of second causes that were
# not there one explained 1056 and left 2629, another 8300 and left 108 000, both beside glue that failed under way.
_SHARED = 1000.0


def least_gain(first: Candidate, labels: Collection[str], none: float) -> float:
    """Return by how much two causes with these labels must raise the log evidence beyond a first one.

    That is what the prior of a second one and its choice among all labels cost, and the share of what the first one
    explains that its inexactness may leave for another. Beside 40 single causes of 9 to 370 σ in their right form
    others promised 4.9 at the most, those of negligible size 2.8; but 14 beside friction, and 71 beside relaxation,
    where a bead lay at the corner of the jaws. Of 32 more, diagnosed blind, one was believed to have a second cause
    that is not there: it added 8.0. ``none`` is the log evidence without any cause.
    """
    explained = max(first.log_evidence - none, 0.0)
    inexact = max(effect.inexactness for effect in first.fit.hypothesis.effects)
    choice = float(np.log(len(LABELS)))
    least = choice - LOG_PRIOR_OF_A_PAIR + inexact * explained
    if first.labels[0] not in labels:
        least += choice  # both of its causes are chosen anew
    if UNKNOWN in labels:
        least = max(least, least_remainder(explained))
    return least


def least_of_two(alone: float, none: float) -> float:
    """Return the log evidence that two causes must promise where the best one alone has a log evidence."""
    return alone - _ANOTHER_HOLLOW * max(alone - none, 0.0)


def least_remainder(explained: float) -> float:
    """Return what must be gained by something unknown beside causes that explain so much, or by a cause beside it.

    What is recognised outside the catalogue has one of many forms, none of them its own, and leaves a little too.
    """
    return max(_LEAST_REMAINDER, _REMAINDER * explained)


def beyond_noise(case: Case, candidate: Candidate) -> float:
    """Return by how much the sum of squares that a candidate leaves exceeds that of noise."""
    return candidate.fit.chi2 - _values(candidate) * white_floor(case) ** 2


def adequate(case: Case, candidate: Candidate, error: ModelError) -> bool:
    """Tell whether a candidate leaves no more than noise: something unknown beside it is no more probable than nothing.

    That is sharper than its sum of squares, of which the errors that rows share are a part as well: in right forms the
    log evidence differed by -2.4 to 0.5 on 15 cases, in others by 30 and more.
    """
    return evidence_of_unknown(case, candidate.fit, error) - candidate.log_evidence < _LEAVES


def leaves_less(left: float, gain: float) -> bool:
    """Tell whether two causes leave less beyond noise than the second explains, but for errors that rows share.

    Any two effects explain a part of what no effect alone does. Both are in log density.
    """
    return left < gain + _SHARED


def _may_leave_less(case: Case, leader: Candidate, promised: float) -> bool:
    """Tell whether a second cause could explain more than it leaves, by what two promise to first order."""
    gain = _KEPT * max(promised - leader.log_evidence, 0.0)
    return leaves_less(0.5 * beyond_noise(case, leader) - gain, gain)


def _values(candidate: Candidate) -> int:
    return sum(len(residual) for residual in candidate.fit.residual)


def promising_seconds(
    case: Case, leader: Candidate, trials: Sequence[Trial], error: ModelError, none: float
) -> list[Start]:
    """Return the worthwhile second effects beside a leader, the most promising first.

    Every start of ``trials`` is weighed anew: where the leader's gap is large, a second cause seemed to lie elsewhere.
    """
    others = [trial.signature for trial in trials if trial.signature.effect.label not in leader.labels]
    asked = least_gain(leader, leader.labels, none) - _PROMISED
    tried = best_trials(trials_of(case, leader.fit, error, others, asked)).values()
    alone = first_order_evidence(case, leader.fit, error)
    found = [
        Start(leader.log_evidence + further, trial.start)
        for trial, further in ((trial, trial.log_evidence - alone) for trial in tried)
        if further > least_gain(leader, (*leader.labels, trial.signature.effect.label), none) - _PROMISED
    ]
    return sorted(found, key=lambda start: -start.log_evidence)


def asks_for_a_finer_form(case: Case, leader: Candidate, trials: Sequence[Trial], error: ModelError) -> bool:
    """Tell whether a second effect of a leader's own label promises to explain what the leader leaves.

    A stress that relaxes at two rates, fitted with one, leaves what one more of another rate would take away: 30 in log
    evidence where nothing else told, on a case whose E was off by 4 %. Beside a leader in the right form such promised
    1 at the most on 23 cases, and 11 beside a gripper that slipped by much.
    """
    own = [trial.signature for trial in trials if trial.signature.effect.label in leader.labels]
    promised = max((trial.log_evidence for trial in trials_of(case, leader.fit, error, own)), default=-np.inf)
    return promised - first_order_evidence(case, leader.fit, error) > _FINER_FORM


def starts_of_pairs(
    case: Case,
    baseline: Linearisation,
    leaders: Sequence[Candidate],
    trials: Sequence[Trial],
    error: ModelError,
    none: float,
) -> list[Hypothesis]:
    """Return where refits with two causes should begin: a second one beside each leader, and pairs weighed together.

    Nowhere, where the first leader leaves nothing and nothing is promised beside it: what first order promises beside
    one that falls short would have to explain more than all of the misfit. Nor where the second one would leave more
    than it explains.

    Parameters
    ----------
    baseline : fitted
    leaders : refitted hypotheses of one cause, one at least, the most probable first
    none : log evidence of the baseline
    """
    beside = [
        [
            start
            for start in promising_seconds(case, leader, trials, error, none)[:_PARTNERS]
            # One that would not reach far enough beyond the best single cause is no pair, whatever its leader leaves.
            if start.log_evidence - leaders[0].log_evidence
            > least_gain(leaders[0], start.labels, none) - _PROMISED
        ]
        for leader in leaders
    ]
    if not beside[0] and adequate(case, leaders[0], error):
        return []
    one_by_one = _one_by_one(beside, leaders[0].log_evidence)
    known = [start.labels for start in one_by_one]
    best_trial = max(trial.log_evidence for trial in trials)
    likeliest = _first_of_labels(likeliest_pairs(case, baseline, error, trials))
    likeliest = _not_far_behind(likeliest, best_trial)[:_PAIRS]
    least = least_of_two(leaders[0].log_evidence, none)
    together = [one for one in likeliest if one.labels not in known and one.log_evidence >= least]
    begun = (*one_by_one[: _STARTS - len(together)], *together)
    return [one.hypothesis for one in begun if _may_leave_less(case, leaders[0], one.log_evidence)]


def _one_by_one(beside: Sequence[Sequence[Start]], best_of_one: float) -> list[Start]:
    """Return the most promising second causes of all leaders, and the best one beside the first leader in any case.

    Beside a leader that falls far short, first order promises too much: by 140 more than a true second cause beside the
    first leader, where a refit then kept nothing of it.
    """
    surest = beside[0][:1]
    likeliest = _not_far_behind([start for starts in beside for start in starts], best_of_one)
    return [*surest, *(start for start in likeliest if start not in surest)][:_PARTNERS]


def _first_of_labels(starts: Sequence[Start]) -> list[Start]:
    found: dict[frozenset[str], Start] = {}
    for start in starts:
        found.setdefault(start.labels, start)
    return list(found.values())


def _not_far_behind(starts: Sequence[Start], best_of_one: float) -> list[Start]:
    """Return the starts that promise nearly as much as the best, that first."""
    ordered = sorted(starts, key=lambda start: -start.log_evidence)
    if not ordered:
        return []
    best = ordered[0].log_evidence
    least = best - max(_BEHIND, _BEHIND_SHARE * (best - best_of_one))
    return [start for start in ordered if start.log_evidence >= least]
