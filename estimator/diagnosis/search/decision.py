"""The verdict on a comparison: which cause, or which two, whether none, or something unknown beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.evidence.cross_validation import lost_on_held_out
from estimator.diagnosis.evidence.lack_of_fit import rough_gap, rough_remainder
from estimator.diagnosis.evidence.marginal_likelihood import evidence_of_unknown
from estimator.diagnosis.evidence.noise_floor import white_floor
from estimator.diagnosis.evidence.posterior import of_labels, probabilities, shared_with_unknown
from estimator.diagnosis.model.hypothesis import Hypothesis, negligible_effects
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.pair_search import search_pairs, with_what_it_is_mistaken_for
from estimator.diagnosis.search.screening import best_starts
from estimator.diagnosis.search.second_cause import (
    adequate,
    beyond_noise,
    least_gain,
    least_remainder,
    leaves_less,
)


@dataclass(frozen=True)
class Doubted:
    """A second cause that may be there: it explains a little more beside the leading one, too little to be named.

    Attributes
    ----------
    label : of the catalogue
    adds : by how much it raises the log evidence
    asked : by how much it would have to, for its prior and the choice among all labels
    """

    label: str
    adds: float
    asked: float


@dataclass(frozen=True)
class Verdict:
    """What is concluded.

    Attributes
    ----------
    labels : of the causes, the leading one first, "unknown" among them where something without a label is one, or more
        remains than they explain; empty for none, and where none is too probable for another answer to be named
    winner : the hypothesis with those causes; None for none, and for an unknown that was not recognised
    probability : of every answer, the most probable first
    doubted : second causes beside the leading one that explain a little more, too little to be named
    """

    labels: tuple[str, ...]
    winner: Candidate | None
    probability: Mapping[str, float]
    doubted: tuple[Doubted, ...] = ()


def reach_verdict(comparison: Comparison, evidence: Mapping[str, float]) -> Verdict:
    """Conclude from the log evidence of every answer; look for a second cause, and for what the causes leave."""
    verdict = _likeliest(comparison, evidence)
    in_doubt = verdict.probability[NONE] > comparison.settings.in_doubt
    return Verdict((), None, verdict.probability) if in_doubt else verdict


def _likeliest(comparison: Comparison, evidence: Mapping[str, float]) -> Verdict:
    """Return the verdict that is the most probable, however doubtful."""
    context, settings = comparison.context, comparison.context.settings.evidence
    probability = probabilities(evidence, settings)
    leading = next(iter(probability))
    if leading == NONE:
        beyond = rough_gap(context.baseline.residual, white_floor(context.case), settings)
        if not beyond:
            return Verdict((), None, probability)
        return Verdict((UNKNOWN,), None, shared_with_unknown(probability, NONE, 0.0, beyond))
    outsider = _first_of(comparison, UNKNOWN) if evidence[UNKNOWN] > comparison.unknown else None
    recognised = outsider if leading == UNKNOWN else None
    best = recognised or _first_of(
        comparison, next(label for label in probability if label in context.catalogue.groups)
    )
    if best is None:
        return Verdict((UNKNOWN,), None, probability)
    found = search_pairs(comparison, best)
    if found.alone is not best:
        comparison = replace(comparison, candidates=(*comparison.candidates, found.alone))
        evidence = weigh(comparison)
        probability = probabilities(evidence, settings)
        leading = next(iter(probability))
        best = found.alone if leading in (found.alone.labels[0], UNKNOWN) else best
    worthy = [pair for pair in found.pairs if _worth_two(comparison, best, pair)]
    if worthy and _stands(comparison, best, worthy[0], leading):
        standing = [pair for pair in worthy if _stands(comparison, best, pair, leading)]
        comparison = with_what_it_is_mistaken_for(comparison, standing[0])
        evidence = {**evidence, UNKNOWN: weigh(comparison)[UNKNOWN]}
        return _of_two(comparison, standing, evidence, probability)
    if leading == UNKNOWN:
        return Verdict((UNKNOWN,), recognised, probability)
    verdict = _with_remainder(comparison, best, leading, probability)
    return replace(verdict, doubted=_doubted(comparison, best, found.pairs))


def _doubted(comparison: Comparison, best: Candidate, pairs: Sequence[Candidate]) -> tuple[Doubted, ...]:
    """Return the second causes beside the best one that were refitted and explain more, each in its best form."""
    doubted: dict[str, Doubted] = {}
    for pair in pairs:
        others = set(pair.labels) - {best.labels[0], UNKNOWN}
        adds = pair.log_evidence - best.log_evidence
        asked = least_gain(comparison.context, best, pair.labels, comparison.none)
        if best.labels[0] in pair.labels and others and comparison.settings.strong <= adds < asked:
            label = others.pop()
            doubted.setdefault(label, Doubted(label, adds, asked))
    return tuple(doubted.values())


def _of_two(
    comparison: Comparison,
    pairs: Sequence[Candidate],
    evidence: Mapping[str, float],
    probability: Mapping[str, float],
) -> Verdict:
    """Return the verdict for two causes, of pairs that are believed, the most probable first.

    The stronger cause of each pair has the evidence of the pair, less what the choice among its forms costs: a rival is
    weighed with its own second cause too.
    """
    of_stronger: dict[str, Candidate] = {}
    for pair in pairs:
        of_stronger.setdefault(max(pair.labels, key=lambda label: probability[label]), pair)
    cost = _cost_of_form(comparison)
    raised = {
        label: max(evidence[label], pair.log_evidence - cost[label]) for label, pair in of_stronger.items()
    }
    shared = probabilities({**evidence, **raised}, comparison.context.settings.evidence)
    stronger = max(of_stronger, key=lambda label: shared[label])
    if next(iter(shared)) == UNKNOWN and UNKNOWN not in of_stronger:
        return Verdict((UNKNOWN,), _first_of(comparison, UNKNOWN), shared)
    pair = of_stronger[stronger]
    surplus = max(pair.log_evidence - evidence[stronger], 0.0) if UNKNOWN in pair.labels else 0.0
    return _with_remainder(comparison, pair, stronger, shared, surplus)


def weigh(comparison: Comparison) -> dict[str, float]:
    """Return the log evidence of every answer.

    An effect smaller than anybody would care for keeps the less of its evidence the less that is: a slight error of the
    baseline could feign it. An effect that makes the prediction of left-out experiments worse loses by as much. What is
    unknown is an effect without a label, one as likely as the other, or anything: whichever is more probable.
    """
    forms = of_labels(_forms_weighed(comparison), comparison.none, comparison.context.settings.evidence)
    found = {label: forms.get(label, -np.inf) for label in comparison.context.catalogue.labels}
    found[NONE] = comparison.none
    found[UNKNOWN] = max(comparison.unknown, forms.get(UNKNOWN, -np.inf))
    return found


def _forms_weighed(comparison: Comparison) -> list[tuple[str, str, float]]:
    """Return label, name and log evidence of every form of every effect, refitted where it was."""
    context, settings = comparison.context, comparison.settings
    refitted = {one.fit.hypothesis.effects[0].name for one in comparison.candidates}
    points = [
        (one.fit.hypothesis, one.log_evidence - _lost_on_held_out(context, one))
        for one in comparison.candidates
    ]
    points += [
        (trial.start, trial.log_evidence)
        for trial in best_starts(comparison.trials, settings.starts)
        if trial.signature.effect.name not in refitted
    ]
    return [
        (
            one.effects[0].label,
            one.effects[0].name,
            comparison.none + _believed(one, value - comparison.none, settings.very_strong),
        )
        for one, value in points
    ]


def _cost_of_form(comparison: Comparison) -> dict[str, float]:
    """Return by how much the log evidence of each label falls short of that of its best form."""
    forms, settings = _forms_weighed(comparison), comparison.context.settings.evidence
    best = {label: max(value for other, _, value in forms if other == label) for label, _, _ in forms}
    return {
        label: best[label] - value for label, value in of_labels(forms, comparison.none, settings).items()
    }


def _lost_on_held_out(context: Context, one: Candidate) -> float:
    return lost_on_held_out(one.fit, context.baseline, context.settings.evidence)


def _believed(hypothesis: Hypothesis, gain: float, in_full: float) -> float:
    """Return what a hypothesis keeps of its gain in log evidence: all of it, unless the effect is slight.

    The baseline is not exact; from a gain ``in_full`` on an effect of negligible size is believed as well.
    """
    if not 0.0 < gain < in_full or not negligible_effects(hypothesis):
        return gain
    return gain * gain / in_full


def _stands(comparison: Comparison, best: Candidate, pair: Candidate, leading: str) -> bool:
    """Tell whether two causes stand against something unknown.

    Any two explain a part of what no effect alone does: they must leave no more than noise, or less beyond it than the
    second one explains, and where the unknown leads, less than they explain beyond that.
    """
    ahead, gain = pair.log_evidence - comparison.unknown, pair.log_evidence - best.log_evidence
    settings = comparison.settings
    left = 0.5 * beyond_noise(comparison.context.case, pair)
    little = leaves_less(left, gain, settings.shared) and (leading != UNKNOWN or left < ahead)
    return ahead > settings.decisive and (little or adequate(comparison.context, pair))


def _first_of(comparison: Comparison, label: str) -> Candidate | None:
    """Return the best candidate with a label."""
    return next((one for one in comparison.candidates if one.labels[0] == label), None)


def _with_remainder(
    comparison: Comparison,
    winner: Candidate,
    leading: str,
    probability: Mapping[str, float],
    by_outsider: float = 0.0,
) -> Verdict:
    """Return the verdict for a hypothesis, with "unknown" in it where something more stands out beside its causes.

    ``by_outsider`` is what an effect without a label raises its log evidence by.
    """
    labels = (leading, *(label for label in winner.labels if label != leading))
    if leading == UNKNOWN:
        return Verdict(labels, winner, probability)
    context = comparison.context
    more = evidence_of_unknown(context.case, winner.fit, context.error) - winner.log_evidence
    floor = white_floor(context.case)
    remainder = max(more, rough_remainder(winner.fit.residual, floor, context.settings.evidence))
    explained = winner.log_evidence - comparison.none - by_outsider
    recognised = UNKNOWN in labels
    if not recognised and remainder < least_remainder(explained, comparison.settings):
        return Verdict(labels, winner, probability)
    shared = shared_with_unknown(probability, leading, explained, by_outsider + max(remainder, 0.0))
    if recognised:
        return Verdict(labels, winner, shared)
    if next(iter(shared)) == UNKNOWN:
        return Verdict((UNKNOWN,), None, shared)
    return Verdict((*labels, UNKNOWN), winner, shared)


def _worth_two(comparison: Comparison, best: Candidate, pair: Candidate) -> bool:
    """Tell whether two causes explain enough more than the best one."""
    context = comparison.context
    asked = least_gain(context, best, pair.labels, comparison.none)
    return pair.log_evidence - best.log_evidence >= asked and not _lost_on_held_out(context, pair)
