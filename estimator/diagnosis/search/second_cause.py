"""Where two causes may be at work: what one leaves for another beside it, and what two explain together."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from estimator.diagnosis.evidence.marginal_likelihood import evidence_of_unknown, first_order_evidence
from estimator.diagnosis.evidence.noise_floor import white_floor
from estimator.diagnosis.fitting.case import Case
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.labels import UNKNOWN
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.pair_screening import Start, likeliest_pairs
from estimator.diagnosis.search.screening import Trial, best_trials, trials_of
from estimator.diagnosis.settings import SearchSettings


def least_gain(context: Context, first: Candidate, labels: Collection[str], none: float) -> float:
    """Return by how much two causes with these labels must raise the log evidence beyond a first one.

    That is what the prior of a second one and its choice among all labels cost, and the share of what the first one
    explains that its inexactness may leave for another. Beside 40 single causes of 9 to 370 σ in their right form
    others promised 4.9 at the most, those of negligible size 2.8; but 14 beside friction, and 71 beside relaxation,
    where a bead lay at the corner of the jaws. Of 32 more, diagnosed blind, one was believed to have a second cause
    that is not there: it added 8.0. ``none`` is the log evidence without any cause.
    """
    explained = max(first.log_evidence - none, 0.0)
    inexact = max(effect.inexactness for effect in first.fit.hypothesis.effects)
    settings = context.settings
    choice = float(np.log(len(context.catalogue.labels)))
    least = choice - math.log(settings.evidence.prior_of_a_pair) + inexact * explained
    if first.labels[0] not in labels:
        least += choice  # both of its causes are chosen anew
    if UNKNOWN in labels:
        least = max(least, least_remainder(explained, settings.search))
    return least


def least_of_two(alone: float, none: float, settings: SearchSettings) -> float:
    """Return the log evidence that two causes must promise where the best one alone has a log evidence."""
    return alone - settings.another_hollow * max(alone - none, 0.0)


def least_remainder(explained: float, settings: SearchSettings) -> float:
    """Return what must be gained by something unknown beside causes that explain so much, or by a cause beside it.

    What is recognised outside the catalogue has one of many forms, none of them its own, and leaves a little too.
    """
    return max(settings.decisive, settings.remainder * explained)


def beyond_noise(case: Case, candidate: Candidate) -> float:
    """Return by how much the sum of squares that a candidate leaves exceeds that of noise."""
    return candidate.fit.chi2 - _values(candidate) * white_floor(case) ** 2


def adequate(context: Context, candidate: Candidate) -> bool:
    """Tell whether a candidate leaves no more than noise: something unknown beside it is no more probable than nothing.

    That is sharper than its sum of squares, of which the errors that rows share are a part as well: in right forms the
    log evidence differed by -2.4 to 0.5 on 15 cases, in others by 30 and more.
    """
    unknown = evidence_of_unknown(context.case, candidate.fit, context.error)
    return unknown - candidate.log_evidence < context.settings.search.strong


def leaves_less(left: float, gain: float, shared: float) -> bool:
    """Tell whether two causes leave less beyond noise than the second explains, but for errors that rows share.

    Any two effects explain a part of what no effect alone does. All are in log density, ``shared`` what these errors
    may leave.
    """
    return left < gain + shared


def _may_leave_less(case: Case, leader: Candidate, promised: float) -> bool:
    """Tell whether a second cause could explain more than it leaves, by what two promise to first order."""
    settings = case.settings.search
    gain = settings.kept * max(promised - leader.log_evidence, 0.0)
    return leaves_less(0.5 * beyond_noise(case, leader) - gain, gain, settings.shared)


def _values(candidate: Candidate) -> int:
    return sum(len(residual) for residual in candidate.fit.residual)


def promising_seconds(
    context: Context, leader: Candidate, trials: Sequence[Trial], none: float
) -> list[Start]:
    """Return the worthwhile second effects beside a leader, the most promising first.

    Every start of ``trials`` is weighed anew: where the leader's gap is large, a second cause seemed to lie elsewhere.
    """
    others = [trial.signature for trial in trials if trial.signature.effect.label not in leader.labels]
    settings = context.settings
    asked = least_gain(context, leader, leader.labels, none) - settings.search.mention
    tried = best_trials(trials_of(context.beside(leader.fit), others, asked)).values()
    alone = first_order_evidence(context.case, leader.fit, context.error)
    found = [
        Start(leader.log_evidence + further, trial.start)
        for trial, further in ((trial, trial.log_evidence - alone) for trial in tried)
        if further
        > least_gain(context, leader, (*leader.labels, trial.signature.effect.label), none)
        - settings.search.mention
    ]
    return sorted(found, key=lambda start: -start.log_evidence)


def asks_for_a_finer_form(context: Context, leader: Candidate, trials: Sequence[Trial]) -> bool:
    """Tell whether a second effect of a leader's own label promises to explain what the leader leaves.

    A stress that relaxes at two rates, fitted with one, leaves what one more of another rate would take away: 30 in log
    evidence where nothing else told, on a case whose E was off by 4 %. Beside a leader in the right form such promised
    1 at the most on 23 cases, and 11 beside a gripper that slipped by much.
    """
    own = [trial.signature for trial in trials if trial.signature.effect.label in leader.labels]
    beside = trials_of(context.beside(leader.fit), own)
    promised = max((trial.log_evidence for trial in beside), default=-np.inf)
    alone = first_order_evidence(context.case, leader.fit, context.error)
    return promised - alone > context.settings.search.finer_form


def starts_of_pairs(
    context: Context, leaders: Sequence[Candidate], trials: Sequence[Trial], none: float
) -> list[Hypothesis]:
    """Return where refits with two causes should begin: a second one beside each leader, and pairs weighed together.

    Nowhere, where the first leader leaves nothing and nothing is promised beside it: what first order promises beside
    one that falls short would have to explain more than all of the misfit. Nor where the second one would leave more
    than it explains.

    Parameters
    ----------
    context : with the fitted baseline
    leaders : refitted hypotheses of one cause, one at least, the most probable first
    none : log evidence of the baseline
    """
    settings = context.settings
    search = settings.search
    beside = [
        [
            start
            for start in promising_seconds(context, leader, trials, none)[: search.partners]
            # One that would not reach far enough beyond the best single cause is no pair, whatever its leader leaves.
            if start.log_evidence - leaders[0].log_evidence
            > least_gain(context, leaders[0], start.labels, none) - search.mention
        ]
        for leader in leaders
    ]
    if not beside[0] and adequate(context, leaders[0]):
        return []
    one_by_one = _one_by_one(beside, leaders[0].log_evidence, search)
    known = [start.labels for start in one_by_one]
    best_trial = max(trial.log_evidence for trial in trials)
    likeliest = _first_of_labels(likeliest_pairs(context, trials))
    likeliest = _not_far_behind(likeliest, best_trial, search)[: search.pairs_together]
    least = least_of_two(leaders[0].log_evidence, none, search)
    together = [one for one in likeliest if one.labels not in known and one.log_evidence >= least]
    begun = (*one_by_one[: search.starts_of_pairs - len(together)], *together)
    return [one.hypothesis for one in begun if _may_leave_less(context.case, leaders[0], one.log_evidence)]


def _one_by_one(
    beside: Sequence[Sequence[Start]], best_of_one: float, settings: SearchSettings
) -> list[Start]:
    """Return the most promising second causes of all leaders, and the best one beside the first leader in any case.

    Beside a leader that falls far short, first order promises too much: by 140 more than a true second cause beside the
    first leader, where a refit then kept nothing of it.
    """
    surest = beside[0][:1]
    likeliest = _not_far_behind([start for starts in beside for start in starts], best_of_one, settings)
    return [*surest, *(start for start in likeliest if start not in surest)][: settings.partners]


def _first_of_labels(starts: Sequence[Start]) -> list[Start]:
    found: dict[frozenset[str], Start] = {}
    for start in starts:
        found.setdefault(start.labels, start)
    return list(found.values())


def _not_far_behind(starts: Sequence[Start], best_of_one: float, settings: SearchSettings) -> list[Start]:
    """Return the starts that promise nearly as much as the best, that first."""
    ordered = sorted(starts, key=lambda start: -start.log_evidence)
    if not ordered:
        return []
    best = ordered[0].log_evidence
    least = best - max(settings.close, settings.behind * (best - best_of_one))
    return [start for start in ordered if start.log_evidence >= least]
