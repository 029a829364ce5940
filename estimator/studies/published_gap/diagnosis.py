"""The diagnosis of a published gap: simulations, the map learnt from them, and models of the pattern compared.

Every model holds locking. Locking alone, all single causes together and all pairs together have the same prior
probability, within each class every model the same. For a withheld part of the table, models are chosen and learnt on
the rest alone: every single cause, and, where an anchoring is withheld, every pair that holds the best of them there.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from estimator.studies.published_gap.candidate import Candidate
from estimator.studies.published_gap.candidates import CANDIDATES
from estimator.studies.published_gap.learning import Check, ResponseMap
from estimator.studies.published_gap.pattern import PatternModel
from estimator.studies.published_gap.pattern_fit import PatternFit, PatternResult
from estimator.studies.published_gap.published import PublishedTable
from estimator.studies.published_gap.retractions import ANCHORINGS
from estimator.studies.published_gap.simulations import learning_cases, pair_cases
from estimator.studies.running.campaign import Progress, run_cases
from estimator.studies.running.store import OutcomeStore
from estimator.workers import Workers

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_PAIRED = 1
_PAIRED_FOR = tuple(anchoring.replace("_", " ") for anchoring in ANCHORINGS)
_PAIRS_CHECKED = 4


@dataclass(frozen=True, eq=False)
class Ranking:
    """Models learnt from the same rows, the most probable first.

    Attributes
    ----------
    results : of the models
    probability : of each, (n,)
    """

    results: tuple[PatternResult, ...]
    probability: FloatArray

    @staticmethod
    def of(results: Sequence[PatternResult]) -> "Ranking":
        """Rank models by their posterior probability."""
        counts = [len(result.model.causes) for result in results]
        prior = np.array([-np.log(counts.count(count)) for count in counts])
        level = np.array([result.log_evidence for result in results]) + prior
        probability = np.exp(level - logsumexp(level))
        order = np.argsort(-probability)
        return Ranking(tuple(results[n] for n in order), probability[order])

    def best(self, causes: int) -> PatternResult:
        """Return the best model with so many causes."""
        return next(result for result in self.results if len(result.model.causes) == causes)

    @property
    def leading(self) -> PatternResult:
        """The most probable model."""
        return self.results[0]

    @property
    def by_cause(self) -> dict[str, float]:
        """The probability that a cause takes part, the largest first."""
        total: dict[str, float] = {}
        for result, probability in zip(self.results, self.probability, strict=True):
            for cause in result.model.causes:
                total[cause.name] = total.get(cause.name, 0.0) + float(probability)
        return dict(sorted(total.items(), key=lambda item: -item[1]))

    @property
    def by_place(self) -> dict[str, float]:
        """The probability that something of a place of the rig takes part, or of the bench test; the largest first."""
        total: dict[str, float] = {}
        for result, probability in zip(self.results, self.probability, strict=True):
            for place in {cause.place for cause in result.model.causes}:
                total[place] = total.get(place, 0.0) + float(probability)
        return dict(sorted(total.items(), key=lambda item: -item[1]))


@dataclass(frozen=True, eq=False)
class Withheld:
    """A part of the table that was not learnt from, and the models that were chosen and learnt on the rest."""

    name: str
    rows: BoolArray
    ranking: Ranking


@dataclass(frozen=True, eq=False)
class GapDiagnosis:
    """What is to be said of a published table.

    Attributes
    ----------
    table : the published one
    response : the learnt map
    checks : the map beside simulations that it was not learnt from
    ranking : of the models, from all rows
    withheld : what was predicted of parts that were not learnt from
    """

    table: PublishedTable
    response: ResponseMap
    checks: tuple[Check, ...]
    ranking: Ranking
    withheld: tuple[Withheld, ...]


def diagnose_gap(
    table: PublishedTable,
    store: OutcomeStore,
    workers: Workers,
    progress: Progress,
    candidates: Sequence[Candidate] = CANDIDATES,
) -> GapDiagnosis:
    """Diagnose a published table; what is stored is not done again.

    Raises
    ------
    StudyError
        A simulation failed without which nothing can be learnt, or a worker died.
    """
    cases = learning_cases(table.set_up, candidates)
    outcomes = run_cases(cases, store, workers, progress)
    known = {case.identity: outcome for case, outcome in zip(cases, outcomes, strict=True)}
    response = ResponseMap(table.set_up, candidates, known)
    checks = tuple(check for one in candidates if one.effect for check in response.checks(one))

    def fitted(models: Sequence[PatternModel], rows: BoolArray) -> list[PatternResult]:
        fits = [PatternFit(model, tuple(map(bool, rows))) for model in models]
        found = run_cases(fits, store, workers, progress)
        return [fit.found(one.row) for fit, one in zip(fits, found, strict=True) if one.row is not None]

    everything = np.ones(len(table.estimates), dtype=bool)
    pairs = list(itertools.combinations(candidates, 2))
    ranking = Ranking.of(fitted(_models(table, response, candidates, pairs), everything))
    checks += tuple(_pair_checks(ranking, response, store, workers, progress))
    withheld = []
    for name, rows in withheld_parts(table):
        singles = fitted(_models(table, response, candidates, []), ~rows)
        best = [result.model.causes[0] for result in Ranking.of(singles).results if result.model.causes]
        led = set(best[:_PAIRED]) if name in _PAIRED_FOR else set()
        held = [PatternModel(table, pair, response) for pair in pairs if set(pair) & led]
        paired = fitted(held, ~rows) if held else []
        withheld.append(Withheld(name, rows, Ranking.of([*singles, *paired])))
    return GapDiagnosis(table, response, checks, ranking, tuple(withheld))


def _pair_checks(
    ranking: Ranking, response: ResponseMap, store: OutcomeStore, workers: Workers, progress: Progress
) -> list[Check]:
    """Return the map beside simulations of the best pairs, at their median sizes in the material in the middle."""
    best = [
        result
        for result in ranking.results
        if len(result.model.causes) == 2 and all(cause.effect for cause in result.model.causes)
    ][:_PAIRS_CHECKED]
    found = []
    for result in best:
        modulus = np.median(np.median(result.model.true_modulus(result.draws), axis=0))
        values = result.model.size_values(result.draws)
        at = []
        for cause in result.model.causes:
            medians = [float(np.median(values[f"{cause.name} {size.name}"])) for size in cause.sizes]
            scaled = [
                float(f"{float(size.at_reference(np.array(median), np.array(modulus))):.2g}")
                for size, median in zip(cause.sizes, medians, strict=True)
            ]
            at.append(tuple(scaled))
        cases = pair_cases(response.set_up, result.model.causes, at)
        check = response.pair_check(result.model.causes, at, run_cases(cases, store, workers, progress))
        found += [] if check is None else [check]
    return found


def _models(
    table: PublishedTable,
    response: ResponseMap,
    candidates: Sequence[Candidate],
    pairs: Sequence[tuple[Candidate, ...]],
) -> list[PatternModel]:
    causes = [(), *((one,) for one in candidates), *pairs]
    return [PatternModel(table, chosen, response) for chosen in causes]


def withheld_parts(table: PublishedTable) -> list[tuple[str, BoolArray]]:
    """Return what is withheld in turn: each anchoring, each material, where there is more than one of them."""
    anchoring = table.condition_of // 3
    parts = [
        (ANCHORINGS[number].replace("_", " "), anchoring == number) for number in np.unique(anchoring)[::-1]
    ]
    if len(parts) < 2:
        parts = []
    material = table.material_of
    if len(np.unique(material)) > 1:
        parts += [(table.materials[number], material == number) for number in np.unique(material)]
    return parts
