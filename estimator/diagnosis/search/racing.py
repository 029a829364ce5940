"""A race of hypotheses: each is refitted as far as it could still win, for every point costs a solution of the case."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, as_completed
from dataclasses import dataclass, replace

from estimator.diagnosis.evidence.posterior import power_at
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.fitting.parallel import Solve, refits_at_a_time, solved_by
from estimator.diagnosis.fitting.refit import refit
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate, candidate_of, is_determined, most_probable_first
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.settings import SearchSettings
from estimator.effects.effect import Effect
from estimator.errors import SolverError
from estimator.inference.linear_model import objective

# Shares of the way from a solved neighbour that are tried one after the other, and whether its fields are begun from.
_RETRIES = ((1.0, True), (1 / 3, True), (1.0, False), (1 / 3, False), (1 / 9, False))


@dataclass(frozen=True)
class Round:
    """One more round of a race.

    Attributes
    ----------
    points : that each of those in it may have
    within : of the leader's gain the share that they may lack
    of_a_label : how many of the same labels are in it at the most
    """

    points: int
    within: float
    of_a_label: int


def rounds_of(settings: SearchSettings) -> list[Round]:
    """Return the rounds of a race."""
    return [
        Round(*each)
        for each in zip(settings.round_points, settings.round_shares, settings.round_forms, strict=True)
    ]


def race(
    context: Context, starts: Sequence[Hypothesis], bar: float, of_one_place: bool = False
) -> list[Candidate]:
    """Refit hypotheses from their starts, and return them with the most probable first.

    After one point, those within a share of the leader's gain go on to a second one. After that those go on that are
    within less of it, and of many the first. The evidence after a point is that at the end of the next Newton step,
    which a form that is far from linear meets only roughly at first.

    Parameters
    ----------
    context : with the fitted baseline, whose fields the refits start from
    starts : one without equilibrium anywhere near drops out, see :func:`not_solved`
    bar : log evidence that they compete to exceed; what remains much below it goes no further
    of_one_place : whether they lie around one place and end together: then the best after one point goes on alone
    """
    solve = solved_by(context.executor)
    with refits_at_a_time(len(starts)) as threads:
        jobs = [threads.submit(first_point, context.case, start, context.baseline, solve) for start in starts]
        first = _candidates(context, dict.fromkeys(jobs, math.inf))
    first = first[:1] if of_one_place else first
    chosen = worth_a_second_point(first, bar, context.settings.search)
    return to_the_end(context, _further(context, first, chosen, 1), bar)


def not_solved(starts: Sequence[Hypothesis], candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Return the labels of single causes that were raced from some starts, none of which had an equilibrium."""
    solved = {one.labels[0] for one in candidates}
    raced = dict.fromkeys(start.effects[0].label for start in starts if len(start.effects) == 1)
    return tuple(label for label in raced if label not in solved)


def race_on(context: Context, fits: Sequence[Linearisation], bar: float) -> list[Candidate]:
    """Weigh fits as :func:`race` does its own, refit the finalists among them, and return all."""
    return to_the_end(context, most_probable_first([candidate_of(context, fit) for fit in fits]), bar)


def to_the_end(context: Context, candidates: Sequence[Candidate], bar: float) -> list[Candidate]:
    """Return candidates, the finalists of each round refitted further, in the end until they converge.

    They come and go the most probable first, weighed in this context. One that gained little in its last
    refit, and lacks more, is not refitted again.
    """
    settings, found = context.settings.search, list(candidates)
    for each in rounds_of(settings):
        chosen = [
            one for one in finalists(found, bar, settings, each) if may_win(one, found[0], bar, settings)
        ]
        found = _further(context, found, chosen, each.points)
    return found


def may_win(one: Candidate, best: Candidate, bar: float, settings: SearchSettings) -> bool:
    """Tell whether a candidate lacks no more than what it could still gain: of what fell last, some more."""
    lacks = max(best.log_evidence, bar) - one.log_evidence
    return lacks <= max(settings.mention, settings.more_to_come * one.fell)


def finalists(
    candidates: Sequence[Candidate], bar: float, settings: SearchSettings, of: Round | None = None
) -> list[Candidate]:
    """Return the few, the most probable first, that a better fit could still bring to the front.

    Those are within a share of what the best has gained on the bar. Many starts of one label often end in the same
    place, and its forms compete with its rivals more than with each other: they leave places to these. They are those
    of the first round, where none is named.
    """
    of = of or rounds_of(settings)[0]
    chosen: list[Candidate] = []
    taken: Counter[tuple[str, ...]] = Counter()
    for one in _in_reach(candidates, bar, of.within, settings.close):
        if taken[one.labels] < of.of_a_label:
            chosen.append(one)
            taken[one.labels] += 1
    return chosen[: settings.finalists]


def worth_a_second_point(
    candidates: Sequence[Candidate], bar: float, settings: SearchSettings
) -> list[Candidate]:
    """Return those that a second point could bring among the finalists; where all is linear, the first foretold it."""
    near = _in_reach(candidates, bar, rounds_of(settings)[0].within, settings.close)
    return [
        one
        for one in _in_reach(candidates, bar, settings.in_reach, settings.close)
        if one in near or not all(is_linear(effect) for effect in one.fit.hypothesis.effects)
    ]


def is_linear(effect: Effect) -> bool:
    """Tell whether an effect is a linear change of what the sensors make of the tissue."""
    return not effect.acts_on_tissue and all(constant.fixed for constant in effect.constants)


def _in_reach(candidates: Sequence[Candidate], bar: float, share: float, close: float) -> list[Candidate]:
    """Return those within a share of what the best has gained on the bar, or close to it."""
    best = candidates[0].log_evidence if candidates else bar
    least = max(best - max(close, share * (best - bar)), bar - close)
    return [one for one in candidates if one.log_evidence > least]


def _further(
    context: Context, candidates: Sequence[Candidate], chosen: Sequence[Candidate], points: int
) -> list[Candidate]:
    """Return the candidates, the chosen ones refitted over so many points more at the most."""
    case, solve = context.case, solved_by(context.executor)
    with refits_at_a_time(len(chosen)) as threads:
        jobs: dict[Future[Linearisation | None], float] = {
            threads.submit(
                refit, case, one.fit.hypothesis, one.fit, 1 + points, solve, _worthwhile(context, one.fit)
            ): objective(one.fit)
            for one in chosen
        }
        further = _candidates(context, jobs)
    rest = [one for one in candidates if one not in chosen]
    return most_probable_first([*further, *rest])


def _worthwhile(context: Context, fit: Linearisation) -> float:
    """Return by how much an objective must fall to matter: tempered as evidences are, by what is gained."""
    gained = objective(context.baseline) - objective(fit)
    return context.settings.fitting.worthwhile / power_at(gained, context.settings.evidence)


def polished(context: Context, winner: Candidate) -> Candidate:
    """Return the winner of a race at its best parameters: to win, a place near them was enough."""
    points = 1 + context.settings.search.polish
    fit = refit(context.case, winner.fit.hypothesis, winner.fit, points, solved_by(context.executor))
    return winner if fit is winner.fit else candidate_of(context, fit)


def _candidates(context: Context, jobs: Mapping[Future[Linearisation | None], float]) -> list[Candidate]:
    """Return what refits have found, weighed; ``jobs`` gives the objective at which each began."""
    found = []
    for done, job in enumerate(as_completed(jobs), start=1):
        fit = job.result()
        if fit is not None and is_determined(fit):
            fell = jobs[job] - objective(fit)
            found.append(replace(candidate_of(context, fit), fell=fell))
        context.tell("refitting the leaders", done, len(jobs))
    return most_probable_first(found)


def first_point(case: Case, start: Hypothesis, near: Linearisation, solve: Solve) -> Linearisation | None:
    """Solve a start; where that has no equilibrium, one nearer to the solved neighbour; None where none has any.

    The last ones are followed from rest in shorter steps, which costs more: a neighbour's field may lead astray.
    """
    for share, known in _RETRIES:
        nearer = start if share == 1.0 else start_nearer(start, near.hypothesis, share)
        try:
            return refit(case, nearer, near if known else None, evaluations=1, solve=solve)
        except SolverError:
            continue
    return None


def start_nearer(start: Hypothesis, to: Hypothesis, share: float) -> Hypothesis:
    """Return a start with only a share of the way that its E, ν and amplitudes have gone from a solved neighbour.

    Amplitudes go from their null, unless the neighbour has the same effect; constants stay.
    """
    known = dict(zip((effect.name for effect in to.effects), to.values, strict=True))
    values: list[Mapping[str, float]] = []
    for effect, present in zip(start.effects, start.values, strict=True):
        begun = known.get(effect.name, {})
        names = {amplitude.name for amplitude in effect.amplitudes}
        values.append(
            {
                key: begun.get(key, 0.0) + share * (value - begun.get(key, 0.0)) if key in names else value
                for key, value in present.items()
            }
        )
    return replace(start.with_material_between(to, share), values=tuple(values))
