"""The verdict on a comparison: which cause, or which two, whether none, or something unknown beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.evidence.cross_validation import lost_on_held_out
from estimator.diagnosis.evidence.lack_of_fit import rough_gap
from estimator.diagnosis.evidence.noise_floor import white_floor
from estimator.diagnosis.evidence.posterior import (
    no_likelier_than_solved,
    of_labels,
    probabilities,
    shared_with_unknown,
)
from estimator.diagnosis.model.hypothesis import Hypothesis, negligible_effects
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.comparison import Comparison, with_refitted
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.models import Model
from estimator.diagnosis.search.pair_search import search_pairs, with_what_it_is_mistaken_for
from estimator.diagnosis.search.screening import best_starts


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
    verdict = replace(verdict, probability=no_likelier_than_solved(verdict.probability, comparison.unsolved))
    in_doubt = verdict.probability[NONE] > comparison.settings.in_doubt
    return Verdict((), None, verdict.probability) if in_doubt else verdict


def _likeliest(comparison: Comparison, evidence: Mapping[str, float]) -> Verdict:
    """Return the verdict that is the most probable, however doubtful."""
    probability = _probabilities(comparison, evidence)
    leading, groups = _leading(comparison, probability), comparison.context.catalogue.groups
    outsider = _first_of(comparison, UNKNOWN) if evidence[UNKNOWN] > comparison.unknown else None
    recognised = outsider if leading == UNKNOWN else None
    solved = (label for label in probability if label in groups and label not in comparison.unsolved)
    best = recognised or _first_of(comparison, next(solved, UNKNOWN))
    if leading == NONE:
        verdict = _without_cause(comparison, probability)
    elif best is None:
        verdict = Verdict((UNKNOWN,), None, probability)
    else:
        found = search_pairs(comparison, best)
        if found.alone is not best:
            comparison = replace(comparison, candidates=(*comparison.candidates, found.alone))
            evidence = weigh(comparison)
            leading = _leading(comparison, _probabilities(comparison, evidence))
            best = found.alone if leading in (found.alone.labels[0], UNKNOWN) else best
        verdict = _of_causes(comparison, evidence, best, found.pairs, recognised)
    return verdict


def _probabilities(comparison: Comparison, evidence: Mapping[str, float]) -> dict[str, float]:
    """Return the probability of every answer beside what the model's own error could feign."""
    return probabilities(evidence, comparison.context.settings.evidence, comparison.feigned)


def _without_cause(comparison: Comparison, probability: Mapping[str, float]) -> Verdict:
    """Return the verdict where no cause is the most probable: none, or something unknown that no cause resembles."""
    context = comparison.context
    rough = rough_gap(context.baseline.residual, white_floor(context.case), context.settings.evidence)
    (model,) = (one for one in comparison.table.without_cause(rough) if one.verdict == "believed")
    shared = shared_with_unknown(probability, NONE, 0.0, rough) if model.unknown else probability
    return Verdict((UNKNOWN,) if model.unknown else (), None, shared)


def _of_causes(
    comparison: Comparison,
    evidence: Mapping[str, float],
    best: Candidate,
    pairs: Sequence[Candidate],
    recognised: Candidate | None,
) -> Verdict:
    """Return the verdict for causes: two that are believed, else the best one, or something unknown where that leads.

    ``recognised`` is the effect without a label as which something unknown that led was recognised.
    """
    probability = _probabilities(comparison, evidence)
    leading = _leading(comparison, probability)
    models = comparison.table.with_two(best, pairs, leading == UNKNOWN)
    believed = [both for both in zip(pairs, models, strict=True) if both[1].verdict == "believed"]
    if believed and believed[0][1] is next(model for model in models if model.explains_more):
        comparison = with_what_it_is_mistaken_for(comparison, believed[0][0])
        evidence = {**evidence, UNKNOWN: weigh(comparison)[UNKNOWN]}
        verdict = _of_two(comparison, believed, evidence, probability)
    elif leading == UNKNOWN:
        verdict = Verdict((UNKNOWN,), recognised, probability)
    else:
        model = comparison.table.with_one(best)
        alone = _with_remainder(comparison, (best, model), leading, probability)
        verdict = replace(alone, doubted=_doubted(comparison, best, models))
    return verdict


def _doubted(comparison: Comparison, best: Candidate, models: Sequence[Model]) -> tuple[Doubted, ...]:
    """Return the second causes beside the best one that explain more, but too little, each in its best form."""
    doubted: dict[str, Doubted] = {}
    for model in models:
        others = set(model.causes) - {best.labels[0], UNKNOWN}
        adds = model.log_evidence - best.log_evidence
        asked = comparison.table.asked(model)
        slight = model.verdict == "explains too little" and adds >= comparison.settings.strong
        if best.labels[0] in model.causes and others and slight:
            label = others.pop()
            doubted.setdefault(label, Doubted(label, adds, asked))
    return tuple(doubted.values())


def _of_two(
    comparison: Comparison,
    pairs: Sequence[tuple[Candidate, Model]],
    evidence: Mapping[str, float],
    probability: Mapping[str, float],
) -> Verdict:
    """Return the verdict for two causes, of pairs that are believed with their models, the most probable first.

    The stronger cause of each pair has the evidence of the pair, less what the choice among its forms costs: a rival is
    weighed with its own second cause too.
    """
    of_stronger: dict[str, tuple[Candidate, Model]] = {}
    for both in pairs:
        of_stronger.setdefault(max(both[0].labels, key=lambda label: probability[label]), both)
    cost = _cost_of_form(comparison)
    raised = {
        label: max(evidence[label], pair.log_evidence - cost[label])
        for label, (pair, _) in of_stronger.items()
    }
    shared = _probabilities(comparison, {**evidence, **raised})
    stronger = max(of_stronger, key=lambda label: shared[label])
    pair, model = of_stronger[stronger]
    surplus = max(pair.log_evidence - evidence[stronger], 0.0) if UNKNOWN in pair.labels else 0.0
    if next(iter(shared)) == UNKNOWN and UNKNOWN not in of_stronger:
        verdict = Verdict((UNKNOWN,), _first_of(comparison, UNKNOWN), shared)
    else:
        verdict = _with_remainder(comparison, (pair, model), stronger, shared, surplus)
    return verdict


def with_contenders_refitted(comparison: Comparison) -> Comparison:
    """Return the comparison with every cause refitted that leads: to first order alone nothing is concluded from it."""
    for _ in comparison.context.catalogue.labels:
        solved = {one.labels[0] for one in comparison.candidates}
        probability = probabilities(weigh(comparison), comparison.context.settings.evidence)
        leading = _leading(comparison, probability)
        if leading in (NONE, UNKNOWN) or leading in solved:
            break
        comparison = with_refitted(comparison, leading)
    return comparison


def _leading(comparison: Comparison, probability: Mapping[str, float]) -> str:
    """Return the most probable answer of those that were solved; ``probability`` has the most probable first."""
    return next(label for label in probability if label not in comparison.unsolved)


def weigh(comparison: Comparison) -> dict[str, float]:
    """Return the log evidence of every answer.

    An effect smaller than anybody would care for keeps the less of its evidence the less that is: a slight error of the
    baseline could feign it. An effect that makes the prediction of left-out experiments worse loses by as much. What is
    unknown is an effect without a label, one as likely as the other, or anything: whichever is more probable.

    What first order promises of a cause that could not be solved is not known to be kept, and not refuted: it counts
    for no more than the best answer that was solved.
    """
    forms = of_labels(_forms_weighed(comparison), comparison.none, comparison.context.settings.evidence)
    found = {label: forms.get(label, -np.inf) for label in comparison.context.catalogue.labels}
    found[NONE] = comparison.none
    found[UNKNOWN] = max(comparison.unknown, forms.get(UNKNOWN, -np.inf))
    most = max(value for label, value in found.items() if label not in comparison.unsolved)
    return {
        label: min(value, most) if label in comparison.unsolved else value for label, value in found.items()
    }


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
    slight = 0.0 < gain < in_full and bool(negligible_effects(hypothesis))
    return gain * gain / in_full if slight else gain


def _first_of(comparison: Comparison, label: str) -> Candidate | None:
    """Return the best candidate with a label."""
    return next((one for one in comparison.candidates if one.labels[0] == label), None)


def _with_remainder(
    comparison: Comparison,
    named: tuple[Candidate, Model],
    leading: str,
    probability: Mapping[str, float],
    by_outsider: float = 0.0,
) -> Verdict:
    """Return the verdict for a hypothesis, with "unknown" in it where something more stands out beside its causes.

    Parameters
    ----------
    named : the hypothesis refitted, and its model
    by_outsider : what an effect without a label raises its log evidence by
    """
    winner, alone = named
    labels = (leading, *(label for label in winner.labels if label != leading))
    verdict = Verdict(labels, winner, probability)
    if leading != UNKNOWN:
        beside = comparison.table.beside(alone, winner, by_outsider)
        if UNKNOWN in labels or beside.verdict == "believed":
            explained = winner.log_evidence - comparison.none - by_outsider
            remainder = max(beside.log_evidence - alone.log_evidence, 0.0)
            shared = shared_with_unknown(probability, leading, explained, by_outsider + remainder)
            verdict = _sharing(labels, winner, shared)
    return verdict


def _sharing(labels: tuple[str, ...], winner: Candidate, shared: Mapping[str, float]) -> Verdict:
    """Return the verdict for causes that share the probability with something unknown beside them."""
    overtaken = UNKNOWN not in labels and next(iter(shared)) == UNKNOWN
    left = () if overtaken else labels
    return Verdict(tuple(dict.fromkeys((*left, UNKNOWN))), None if overtaken else winner, shared)
