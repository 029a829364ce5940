"""A race of hypotheses: each is refitted as far as it could still win, for every point costs a solution of the case."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass, replace

from estimator.diagnosis.evidence.discrepancy import ModelError
from estimator.diagnosis.evidence.posterior import power_at
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.fitting.gauss_newton import WORTHWHILE, objective, refit
from estimator.diagnosis.fitting.parallel import Solve, refits_at_a_time, solved_by
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate, candidate_of, most_probable_first
from estimator.diagnosis.search.screening import Tell
from estimator.diagnosis.sensitivity.mechanical_changes import acts_on_tissue
from estimator.effects.effect import Effect
from estimator.errors import SolverError


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


# After one point, those within this share of the leader's gain (or this close to it) go on to a second one. After that
# those go on that are within less of it, and of many the first. The evidence after a point is that at the end of the
# next Newton step, which a form that is far from linear meets only roughly at first.
_IN_REACH, _CLOSE = 0.4, 10.0
_FINAL = Round(points=2, within=0.15, of_a_label=2)
_ROUNDS = (_FINAL, Round(points=5, within=0.05, of_a_label=1))
_FINALISTS = 3
# One that lacks more than this goes on only where its last few points gained some share of what it lacks.
_NEXT_TO_IT, _MORE_TO_COME = 1.0, 2.0
_POLISH = 3


def race(
    case: Case,
    base: Linearisation,
    error: ModelError,
    starts: Sequence[Hypothesis],
    bar: float,
    executor: Executor,
    tell: Tell,
) -> list[Candidate]:
    """Refit hypotheses from their starts, and return them with the most probable first.

    Parameters
    ----------
    case, base, error : with the fitted baseline, whose fields the refits start from
    starts : one without equilibrium near its start drops out
    bar : log evidence that they compete to exceed; what remains much below it goes no further
    executor, tell : workers, and who is told of the progress
    """
    solve = solved_by(executor)
    with refits_at_a_time(len(starts)) as threads:
        jobs = [threads.submit(_first_point, case, start, base, solve) for start in starts]
        first = _candidates(case, base, error, dict.fromkeys(jobs, math.inf), tell)
    second = _further(case, base, error, first, worth_a_second_point(first, bar), 1, executor, tell)
    return to_the_end(case, base, error, second, bar, executor, tell)


def race_on(
    case: Case,
    base: Linearisation,
    error: ModelError,
    fits: Sequence[Linearisation],
    bar: float,
    executor: Executor,
    tell: Tell,
) -> list[Candidate]:
    """Weigh fits as :func:`race` does its own, refit the finalists among them, and return all."""
    weighed = most_probable_first([candidate_of(case, base, error, fit) for fit in fits])
    return to_the_end(case, base, error, weighed, bar, executor, tell)


def to_the_end(
    case: Case,
    base: Linearisation,
    error: ModelError,
    candidates: Sequence[Candidate],
    bar: float,
    executor: Executor,
    tell: Tell,
) -> list[Candidate]:
    """Return candidates, the finalists of each round refitted further, in the end until they converge.

    They come and go the most probable first, weighed in this case with this error. One that gained little in its last
    refit, and lacks more, is not refitted again.
    """
    found = list(candidates)
    for each in _ROUNDS:
        chosen = [one for one in finalists(found, bar, each) if may_win(one, found[0], bar)]
        found = _further(case, base, error, found, chosen, each.points, executor, tell)
    return found


def may_win(one: Candidate, best: Candidate, bar: float) -> bool:
    """Tell whether a candidate lacks no more than what it could still gain: of what fell last, some more."""
    lacks = max(best.log_evidence, bar) - one.log_evidence
    return lacks <= max(_NEXT_TO_IT, _MORE_TO_COME * one.fell)


def finalists(candidates: Sequence[Candidate], bar: float, of: Round = _FINAL) -> list[Candidate]:
    """Return the few, the most probable first, that a better fit could still bring to the front.

    Those are within a share of what the best has gained on the bar. Many starts of one label often end in the same
    place, and its forms compete with its rivals more than with each other: they leave places to these.
    """
    chosen: list[Candidate] = []
    taken: Counter[tuple[str, ...]] = Counter()
    for one in _in_reach(candidates, bar, of.within):
        if taken[one.labels] < of.of_a_label:
            chosen.append(one)
            taken[one.labels] += 1
    return chosen[:_FINALISTS]


def worth_a_second_point(candidates: Sequence[Candidate], bar: float) -> list[Candidate]:
    """Return those that a second point could bring among the finalists; where all is linear, the first foretold it."""
    near = _in_reach(candidates, bar, _FINAL.within)
    return [
        one
        for one in _in_reach(candidates, bar, _IN_REACH)
        if one in near or not all(is_linear(effect) for effect in one.fit.hypothesis.effects)
    ]


def is_linear(effect: Effect) -> bool:
    """Tell whether an effect is a linear change of what the sensors make of the tissue."""
    return not acts_on_tissue(effect) and all(constant.fixed for constant in effect.constants)


def _in_reach(candidates: Sequence[Candidate], bar: float, share: float) -> list[Candidate]:
    """Return those within a share of what the best has gained on the bar."""
    if not candidates:
        return []
    best = candidates[0].log_evidence
    least = max(best - max(_CLOSE, share * (best - bar)), bar - _CLOSE)
    return [one for one in candidates if one.log_evidence > least]


def _further(
    case: Case,
    base: Linearisation,
    error: ModelError,
    candidates: Sequence[Candidate],
    chosen: Sequence[Candidate],
    points: int,
    executor: Executor,
    tell: Tell,
) -> list[Candidate]:
    """Return the candidates, the chosen ones refitted over so many points more at the most."""
    solve = solved_by(executor)
    with refits_at_a_time(len(chosen)) as threads:
        jobs: dict[Future[Linearisation | None], float] = {
            threads.submit(
                refit, case, one.fit.hypothesis, one.fit, 1 + points, solve, _worthwhile(base, one.fit)
            ): objective(one.fit)
            for one in chosen
        }
        further = _candidates(case, base, error, jobs, tell)
    rest = [one for one in candidates if one not in chosen]
    return most_probable_first([*further, *rest])


def _worthwhile(base: Linearisation, fit: Linearisation) -> float:
    """Return by how much an objective must fall to matter: tempered as evidences are, by what is gained."""
    return WORTHWHILE / power_at(objective(base) - objective(fit))


def polished(
    case: Case, base: Linearisation, error: ModelError, winner: Candidate, executor: Executor
) -> Candidate:
    """Return the winner of a race at its best parameters: to win, a place near them was enough."""
    fit = refit(case, winner.fit.hypothesis, winner.fit, 1 + _POLISH, solved_by(executor))
    return winner if fit is winner.fit else candidate_of(case, base, error, fit)


def _candidates(
    case: Case,
    base: Linearisation,
    error: ModelError,
    jobs: Mapping[Future[Linearisation | None], float],
    tell: Tell,
) -> list[Candidate]:
    """Return what refits have found, weighed; ``jobs`` gives the objective at which each began."""
    found = []
    for done, job in enumerate(as_completed(jobs), start=1):
        fit = job.result()
        if fit is not None:
            fell = jobs[job] - objective(fit)
            found.append(replace(candidate_of(case, base, error, fit), fell=fell))
        tell("refitting the leaders", done, len(jobs))
    return most_probable_first(found)


def _first_point(case: Case, start: Hypothesis, near: Linearisation, solve: Solve) -> Linearisation | None:
    """Solve a start; where that has no equilibrium, one with ever smaller amplitudes."""
    for _ in range(3):
        try:
            return refit(case, start, near, evaluations=1, solve=solve)
        except SolverError:
            start = _with_smaller_amplitudes(start)
    return None


def _with_smaller_amplitudes(hypothesis: Hypothesis) -> Hypothesis:
    values: list[Mapping[str, float]] = []
    for effect, present in zip(hypothesis.effects, hypothesis.values, strict=True):
        names = {amplitude.name for amplitude in effect.amplitudes}
        values.append({k: v / 3 if k in names else v for k, v in present.items()})
    return Hypothesis(hypothesis.youngs_modulus, hypothesis.poisson_ratio, hypothesis.effects, tuple(values))
