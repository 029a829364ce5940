"""The comparison of hypotheses: all of the catalogue are screened, the leaders refitted, the best of them polished."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

from estimator.diagnosis.evidence.discrepancy import ModelError
from estimator.diagnosis.evidence.marginal_likelihood import (
    error_borne_out,
    evidence_of_unknown,
    first_order_evidence,
)
from estimator.diagnosis.evidence.noise_selection import (
    CaseLeaving,
    in_another_case,
    most_probable_noise,
    noise_cost,
    refitted_anew,
    signatures_anew,
)
from estimator.diagnosis.fitting.case import Case, Linearisation, linearise
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.noise.errors_left import AT_MOST
from estimator.diagnosis.noise.outliers import number_left_out
from estimator.diagnosis.search.baseline import corrected_at_best, prepare
from estimator.diagnosis.search.candidate import Candidate, best_of_labels, most_probable_first
from estimator.diagnosis.search.racing import finalists, race, race_on, to_the_end
from estimator.diagnosis.search.refinements import (
    accidents,
    at_the_place_of,
    elaborations,
    mistaken_for,
    past_kinks,
    siblings,
)
from estimator.diagnosis.search.screening import Tell, Trial, best_starts, screen, trials_of
from estimator.diagnosis.search.second_cause import adequate, asks_for_a_finer_form, promising_seconds
from estimator.effects.catalogue import CATALOGUE, LABELS, OUTSIDERS
from estimator.experiment import Experiment

_CANDIDATES = 7
_FORMS_OF_A_LABEL = 3
# A hypothesis whose first-order evidence is this much below the best is not refitted, unless few are left.
_HOPELESS = 0.35
_FEWEST = 3
# Finalists this close to each other are rivals.
_CLOSE = 10.0
_FINER = 4
# What is mistaken for another explains all but about this share of what that does.
ALIKE = 0.15


@dataclass(frozen=True)
class Comparison:
    """What was tried on a case.

    Attributes
    ----------
    case : Case
    outliers : how many single readings of a bead were left out as wild
    baseline : fitted
    error : what any model misses
    trials : every effect at every start, to first order, the most probable first
    candidates : refitted, the most probable first
    none, unknown : log evidence of the baseline, and of something outside the catalogue beside it
    """

    case: Case
    outliers: int
    baseline: Linearisation
    error: ModelError
    trials: tuple[Trial, ...]
    candidates: tuple[Candidate, ...]
    none: float
    unknown: float

    @property
    def trials_of_labels(self) -> list[Trial]:
        """The trials without those of what has no label."""
        return [trial for trial in self.trials if trial.signature.effect.label in LABELS]


def compare(experiments: Sequence[Experiment], executor: Executor, tell: Tell) -> Comparison:
    """Fit the baseline, then let every effect of the catalogue explain what it leaves.

    Raises
    ------
    InputError, FitError, SolverError
        As :func:`estimator.diagnosis.diagnose.diagnose`.
    """
    tell("fitting the baseline", 0, 1)
    preparation, baseline = prepare(experiments, executor)
    tell("fitting the baseline", 1, 1)
    lenient = preparation.cases(AT_MOST)
    case = most_probable_noise(preparation.cases, lenient, baseline)
    baseline = refitted_anew(baseline, lenient, case)
    error = error_borne_out(case, baseline)
    none, unknown = first_order_evidence(case, baseline, error), evidence_of_unknown(case, baseline, error)
    everything = (*CATALOGUE, *OUTSIDERS)
    plain = [effect for effect in everything if not (effect.elaborates or effect.mistaken_for)]
    trials = screen(case, baseline, error, plain, executor, tell)
    starts = [trial.start for trial in _leaders(best_starts(trials), none)]
    candidates = race(case, baseline, error, starts, none, executor, tell)
    left_out = number_left_out(experiments, case.experiments)
    comparison = Comparison(case, left_out, baseline, error, tuple(trials), tuple(candidates), none, unknown)
    preparation = corrected_at_best(preparation, case, candidates, none, executor)
    comparison = _with_most_probable_noise(comparison, preparation.cases, executor, tell)
    finer = _finer(comparison, executor, tell)
    if finer is comparison:
        return comparison
    preparation = corrected_at_best(preparation, finer.case, finer.candidates, finer.none, executor)
    return _with_most_probable_noise(finer, preparation.cases, executor, tell)


def _finer(comparison: Comparison, executor: Executor, tell: Tell) -> Comparison:
    """Return the comparison with finer forms of the leaders refitted, and with what may be mistaken for them."""
    best_few = finalists(comparison.candidates, comparison.none)
    doubtful = _doubtful(comparison, best_few)
    elaborate = elaborations({one.labels[0] for one in doubtful})
    if best_few and _unknown_leads(comparison, best_few[0]):
        elaborate += [effect for effect in accidents() if effect not in elaborate]
    mistaken = mistaken_for(comparison.case, best_few)
    stopped = _best_with_kinks(comparison.case, best_few)
    if not (doubtful or mistaken or stopped):
        return comparison
    case, baseline, error = comparison.case, comparison.baseline, comparison.error
    effects = [*elaborate, *mistaken]
    finer = screen(case, _with_material_of(comparison), error, effects, executor, tell) if effects else []
    begun = best_starts(finer)
    forms = [start for one in doubtful[:1] for start in at_the_place_of(one, comparison.candidates)]
    led = {start.effects[0].name for start in forms}
    forms += [
        one.start
        for one in begun
        if one.signature.effect.label in LABELS and one.signature.effect.name not in led
    ]
    forms += [
        one.start for one in siblings(best_starts(comparison.trials), doubtful[:1], comparison.candidates)
    ]
    others = [trial.start for trial in begun if trial.signature.effect.label not in LABELS]
    leader = comparison.candidates[0].log_evidence
    # What is mistaken for the leader begins where that has its best place: it falls short by more until it has its own.
    behind = leader - ALIKE * (leader - comparison.none)
    found = [
        *race(case, baseline, error, forms[:_FINER], leader, executor, tell),
        *race(case, baseline, error, others[:_FINER], behind, executor, tell),
    ]
    if stopped is not None:
        beyond = past_kinks(case, stopped)
        found += race(case, baseline, error, beyond, stopped.log_evidence, executor, tell)
    # One that falls short of the leader may still be its rival: its evidence is to be that of a refit in full.
    weighed = most_probable_first([*comparison.candidates, *found])
    candidates = to_the_end(case, baseline, error, weighed, comparison.none, executor, tell)
    return replace(comparison, trials=(*comparison.trials, *finer), candidates=tuple(candidates))


def _with_material_of(comparison: Comparison) -> Linearisation:
    """Return the baseline with E and ν of the best candidate, where a form much like it is nearer to linear.

    A stress that relaxes by half leaves half of E: from the fitted E, the shares of two terms begin far off.
    """
    there = comparison.candidates[0].fit.hypothesis
    return linearise(
        comparison.case, Hypothesis(there.youngs_modulus, there.poisson_ratio), comparison.baseline
    )


def _best_with_kinks(case: Case, candidates: Sequence[Candidate]) -> Candidate | None:
    """Return the first candidate whose refit may have stopped at a kink."""
    return next((one for one in candidates if past_kinks(case, one)), None)


def _with_most_probable_noise(
    comparison: Comparison, cases: CaseLeaving, executor: Executor, tell: Tell
) -> Comparison:
    """Return the comparison with the noise, and with the corrections, that the best candidate bears out.

    Neither "none" nor "unknown" is less probable for a noise that was chosen to suit another answer.
    """
    if not comparison.candidates:
        return comparison
    case = most_probable_noise(cases, comparison.case, comparison.candidates[0].fit)
    if case is comparison.case:
        return comparison
    baseline = refitted_anew(comparison.baseline, comparison.case, case)
    fits = [in_another_case(one.fit, comparison.case, case) for one in comparison.candidates]
    error = error_borne_out(case, fits[0])
    gained = noise_cost(case) - noise_cost(comparison.case)
    none = max(first_order_evidence(case, baseline, error), comparison.none + gained)
    unknown = max(evidence_of_unknown(case, baseline, error), comparison.unknown + gained)
    signatures = signatures_anew([trial.signature for trial in comparison.trials], comparison.case, case)
    return replace(
        comparison,
        case=case,
        baseline=baseline,
        error=error,
        trials=tuple(sorted(trials_of(case, baseline, error, signatures), key=lambda one: -one.log_evidence)),
        candidates=tuple(race_on(case, baseline, error, fits, none, executor, tell)),
        none=none,
        unknown=unknown,
    )


def _leaders(trials: Sequence[Trial], none: float) -> list[Trial]:
    """Return the trials worth a refit: near the best, and not many forms of one label."""
    best = trials[0].log_evidence - none
    chosen: list[Trial] = []
    for trial in trials:
        label = trial.signature.effect.label
        forms = sum(one.signature.effect.label == label for one in chosen)
        gain = trial.log_evidence - none
        if gain < max(-3.0, _HOPELESS * best) and len(chosen) >= _FEWEST:
            break
        if forms < _FORMS_OF_A_LABEL:
            chosen.append(trial)
        if len(chosen) == _CANDIDATES:
            break
    return chosen


def _unknown_leads(comparison: Comparison, best: Candidate) -> bool:
    """Tell whether something unknown is more probable than the best candidate."""
    return comparison.unknown > best.log_evidence


def _doubtful(comparison: Comparison, best_few: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates of which a finer form could win, the most probable first.

    They are rivals close to the best, or what leaves a misfit; or the best alone, where another of its own kind or a
    second cause seems to be beside it: a finer form of one cause is likelier. Where something unknown is more probable
    than all, the best of every label: another cause may have taken the place of one in a form too plain.
    """
    if not best_few:
        return []
    best = best_few[0]
    if _unknown_leads(comparison, best):
        return best_of_labels(comparison.candidates)
    rivals = [one for one in best_few if one.log_evidence > best.log_evidence - _CLOSE]
    if len({one.labels[0] for one in rivals}) > 1:
        return rivals
    if not adequate(comparison.case, best, comparison.error):
        return list(best_few[:2])
    if asks_for_a_finer_form(comparison.case, best, comparison.trials, comparison.error):
        return [best]
    return (
        [best]
        if promising_seconds(comparison.case, best, comparison.trials, comparison.error, comparison.none)
        else []
    )
