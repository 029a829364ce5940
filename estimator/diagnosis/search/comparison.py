"""The comparison of hypotheses: of all that were screened the leaders are refitted, the best of them polished."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from estimator.diagnosis.evidence.feigned import feigned_evidence, may_be_feigned
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
from estimator.diagnosis.model.labels import UNKNOWN
from estimator.diagnosis.search.baseline import Preparation, corrected_at_best
from estimator.diagnosis.search.candidate import Candidate, best_of_labels, most_probable_first
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.models import ModelTable
from estimator.diagnosis.search.racing import finalists, not_solved, race, race_on, to_the_end
from estimator.diagnosis.search.refinements import (
    accidents,
    at_the_place_of,
    elaborations,
    mistaken_for,
    past_kinks,
    siblings,
    with_material_of,
)
from estimator.diagnosis.search.screening import (
    Trial,
    best_starts,
    from_full_size,
    labels_without_signature,
    leading_trials,
    screen,
    trials_of,
)
from estimator.diagnosis.search.second_cause import asks_for_a_finer_form, promising_seconds
from estimator.diagnosis.settings import SearchSettings
from estimator.inference.laplace import log_mean


@dataclass(frozen=True)
class Comparison:
    """What was tried on a case.

    Attributes
    ----------
    context : the case with its fitted baseline
    outliers : how many single readings of a bead were left out as wild
    trials : every effect at every start, to first order, the most probable first
    candidates : refitted, the most probable first
    none, unknown : log evidence of the baseline, and of something outside the catalogue beside it
    unsolved : labels of which no refit had an equilibrium: neither refuted nor borne out
    """

    context: Context
    outliers: int
    trials: tuple[Trial, ...]
    candidates: tuple[Candidate, ...]
    none: float
    unknown: float
    unsolved: tuple[str, ...] = ()

    @property
    def settings(self) -> SearchSettings:
        """How far the search goes."""
        return self.context.settings.search

    @cached_property
    def table(self) -> ModelTable:
        """The models that are held against each other."""
        signatures = tuple(trial.signature for trial in self.trials)
        return ModelTable(self.context, self.none, self.unknown, signatures)

    @property
    def feigned(self) -> float:
        """By how much the log evidence of none rises for what the model's own error could feign of one label or other.

        Along each label's best change of the tissue, or of where it is seen, it may have erred, along one as likely as
        along another.
        """
        context, behind = self.context, 0.0
        found = dict.fromkeys((*context.catalogue.labels, UNKNOWN), 0.0)
        for one in self.candidates:
            (effect, *others), label = one.fit.hypothesis.effects, one.labels[0]
            if may_be_feigned(effect) and not others:
                by_mesh = feigned_evidence(context.case, context.baseline, context.error, one.fit.predicted)
                found[label] = max(found[label], by_mesh)
        if any(found.values()):
            # None may be more probable where the noise was chosen for it than in that which suits another answer.
            behind = first_order_evidence(context.case, context.baseline, context.error) - self.none
        return log_mean([max(behind + by_mesh, 0.0) for by_mesh in found.values()])

    @property
    def trials_of_labels(self) -> list[Trial]:
        """The trials without those of what has no label."""
        labels = self.context.catalogue.groups
        return [trial for trial in self.trials if trial.signature.effect.label in labels]


def compare(preparation: Preparation, screened: Comparison) -> Comparison:
    """Refit the leaders of a comparison whose effects were screened, in finer forms where these could win.

    Parameters
    ----------
    preparation : of the case
    screened : to first order, without candidates

    Raises
    ------
    SolverError
        The baseline has no equilibrium.
    """
    context, none, trials, settings = screened.context, screened.none, screened.trials, screened.settings
    leaders = leading_trials(best_starts(trials, settings.starts), none, settings)
    leaders = from_full_size(context, leaders)
    starts = [trial.start for trial in leaders]
    candidates = race(context, starts, none)
    unsolved = (*not_solved(starts, candidates), *labels_without_signature(context, trials))
    comparison = replace(screened, candidates=tuple(candidates), unsolved=unsolved)
    preparation = corrected_at_best(preparation, context, candidates, none)
    comparison = _with_most_probable_noise(comparison, preparation.cases)
    finer = _finer(comparison)
    if finer is not comparison:
        preparation = corrected_at_best(preparation, finer.context, finer.candidates, finer.none)
        finer = _with_most_probable_noise(finer, preparation.cases)
    return finer


def _finer(comparison: Comparison) -> Comparison:
    """Return the comparison with finer forms of the leaders refitted, and with what may be mistaken for them."""
    context, settings = comparison.context, comparison.settings
    best_few = finalists(comparison.candidates, comparison.none, settings)
    doubtful = _doubtful(comparison, best_few)
    elaborate = elaborations(context.catalogue, {one.labels[0] for one in doubtful})
    if best_few and _unknown_leads(comparison, best_few[0]):
        elaborate += [effect for effect in accidents(context.catalogue) if effect not in elaborate]
    mistaken = mistaken_for(context, best_few)
    stopped = _stopped_at_kink(comparison, best_few)
    if not (doubtful or mistaken or stopped):
        return comparison
    effects = [*elaborate, *mistaken]
    finer = (
        screen(context.beside(with_material_of(context, comparison.candidates[0])), effects)
        if effects
        else []
    )
    begun = best_starts(finer, settings.starts)
    forms = [start for one in doubtful[:1] for start in at_the_place_of(context, one, comparison.candidates)]
    labels = context.catalogue.groups
    led = {start.effects[0].name for start in forms}
    forms += [
        one.start
        for one in begun
        if one.signature.effect.label in labels and one.signature.effect.name not in led
    ]
    tried = best_starts(comparison.trials, settings.starts)
    forms += [one.start for one in siblings(tried, doubtful[:1], comparison.candidates)]
    others = [trial.start for trial in begun if trial.signature.effect.label not in labels]
    leader = comparison.candidates[0].log_evidence
    # What is mistaken for the leader begins where that has its best place: it falls short by more until it has its own.
    behind = leader - settings.alike * (leader - comparison.none)
    found = [
        *race(context, forms[: settings.finer], leader),
        *race(context, others[: settings.finer], behind),
    ]
    if stopped is not None:
        found += race(context, past_kinks(context.case, stopped), stopped.log_evidence, of_one_place=True)
    # One that falls short of the leader may still be its rival: its evidence is to be that of a refit in full.
    weighed = most_probable_first([*comparison.candidates, *found])
    candidates = to_the_end(context, weighed, comparison.none)
    solved = {one.labels[0] for one in candidates}
    return replace(
        comparison,
        trials=(*comparison.trials, *finer),
        candidates=tuple(candidates),
        unsolved=tuple(label for label in comparison.unsolved if label not in solved),
    )


def with_refitted(comparison: Comparison, label: str) -> Comparison:
    """Return the comparison with the forms of a label refitted from their best starts, or with it as not solved."""
    context, settings = comparison.context, comparison.settings
    own = [trial for trial in comparison.trials if trial.signature.effect.label == label]
    starts = [trial.start for trial in best_starts(own, settings.starts)[: settings.forms_of_a_label]]
    found = race(context, starts, comparison.none)
    return replace(
        comparison,
        candidates=tuple(most_probable_first([*comparison.candidates, *found])),
        unsolved=(*comparison.unsolved, *not_solved(starts, found)),
    )


def _stopped_at_kink(comparison: Comparison, candidates: Sequence[Candidate]) -> Candidate | None:
    """Return the first candidate whose refit may have stopped at a kink, unless it leaves nothing."""
    case = comparison.context.case
    first = next((one for one in candidates if past_kinks(case, one)), None)
    return None if first is None or comparison.table.is_whole(first) else first


def _with_most_probable_noise(comparison: Comparison, cases: CaseLeaving) -> Comparison:
    """Return the comparison with the noise, and with the corrections, that the best candidate bears out.

    Neither "none" nor "unknown" is less probable for a noise that was chosen to suit another answer.
    """
    before, case = comparison.context, comparison.context.case
    for best in comparison.candidates[:1]:
        case = most_probable_noise(cases, before.case, best.fit)
    if case is before.case:
        return comparison
    baseline = refitted_anew(before.baseline, before.case, case)
    fits = [in_another_case(one.fit, before.case, case) for one in comparison.candidates]
    error = error_borne_out(case, fits[0])
    gained = noise_cost(case) - noise_cost(before.case)
    none = max(first_order_evidence(case, baseline, error), comparison.none + gained)
    unknown = max(evidence_of_unknown(case, baseline, error), comparison.unknown + gained)
    signatures = signatures_anew([trial.signature for trial in comparison.trials], before.case, case)
    context = replace(before, case=case, baseline=baseline, error=error)
    return replace(
        comparison,
        context=context,
        trials=tuple(sorted(trials_of(context, signatures), key=lambda one: -one.log_evidence)),
        candidates=tuple(race_on(context, fits, none)),
        none=none,
        unknown=unknown,
    )


def _unknown_leads(comparison: Comparison, best: Candidate) -> bool:
    """Tell whether something unknown is more probable than the best candidate."""
    return comparison.unknown > best.log_evidence


def _doubtful(comparison: Comparison, best_few: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates of which a finer form could win, the most probable first.

    They are rivals close to the best, or what leaves a misfit; or the best alone, where another of its own kind or a
    second cause seems to be beside it: a finer form of one cause is likelier. Where something unknown is more probable
    than all, the best of every label: another cause may have taken the place of one in a form too plain.
    """
    close = comparison.settings.close
    rivals = [one for one in best_few if one.log_evidence > best_few[0].log_evidence - close]
    if not best_few:
        found: list[Candidate] = []
    elif _unknown_leads(comparison, best_few[0]):
        found = best_of_labels(comparison.candidates)
    elif len({one.labels[0] for one in rivals}) > 1:
        found = rivals
    elif not comparison.table.is_whole(best_few[0]):
        found = list(best_few[:2])
    else:
        found = [best_few[0]] if _asks_for_more(comparison, best_few[0]) else []
    return found


def _asks_for_more(comparison: Comparison, best: Candidate) -> bool:
    """Tell whether a finer form of the best candidate, or a second cause beside it, promises enough."""
    trials = comparison.trials
    asks = asks_for_a_finer_form(comparison.context, best, trials)
    return asks or bool(promising_seconds(comparison.table, best, trials))
