"""A comparison and its verdict as a diagnosis: everything that is told, from one place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.conclusions.deformation import deformed_mesh
from estimator.diagnosis.conclusions.design_of_experiments import advise
from estimator.diagnosis.conclusions.findings import (
    absent_finding,
    material_quantities,
    present_finding,
    unseen_finding,
)
from estimator.diagnosis.conclusions.gap import gap_of, gaps_by_kind, largest_gaps
from estimator.diagnosis.conclusions.localisation import where_of
from estimator.diagnosis.conclusions.material_known import (
    material_at_bound,
    prior_shares_of_material,
    what_is_doubtful_of_material,
)
from estimator.diagnosis.conclusions.model_averaging import (
    over_answers,
    with_cause_left_open,
    with_form_left_open,
)
from estimator.diagnosis.conclusions.multiple_testing import Multiplicity, multiplicity_of, rivals_of
from estimator.diagnosis.conclusions.open_questions import measurements, what_cannot_be_told
from estimator.diagnosis.conclusions.single_causes import consider
from estimator.diagnosis.evidence.blocks import evidence_of_blocks, shares_of_unknown
from estimator.diagnosis.evidence.cross_validation import held_out_in_full, held_out_residuals
from estimator.diagnosis.evidence.noise_floor import noise_floor
from estimator.diagnosis.evidence.posterior import credible_set, temper
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.result import Consideration, Diagnosis, EffectFinding, Material, Trace
from estimator.diagnosis.search.candidate import Candidate, misfit_ratio, parameter_deviations
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.decision import Verdict
from estimator.diagnosis.search.screening import best_trials, moments_beside
from estimator.experiment.support import supposed_flat

FloatArray = NDArray[np.float64]


def conclude(
    comparison: Comparison, evidence: Mapping[str, float], verdict: Verdict, of_winner: Case
) -> Diagnosis:
    """Tell of a comparison.

    Parameters
    ----------
    evidence : log evidence of every answer
    of_winner : the case in which the winner of the verdict was refitted
    """
    context, settings = comparison.context, comparison.context.settings
    case, baseline, winner = context.case, context.baseline, verdict.winner
    chosen = winner.fit if winner is not None else baseline
    before = held_out_residuals(baseline, settings.evidence)
    after = before if winner is None else held_out_in_full(of_winner, chosen, context.executor)
    best = winner or next(iter(comparison.candidates), None)
    floor = noise_floor(case, best.fit if best is not None else baseline, context.error)
    rivals, seen = rivals_of(context, comparison.trials)
    multiplicity = multiplicity_of(rivals, seen, settings.conclusions)
    effects = _findings(comparison, verdict, after, floor, multiplicity)
    credible = credible_set(verdict.probability, settings.evidence.credible)
    considered = consider(context, comparison.trials_of_labels, comparison.candidates, floor)
    without = _material(baseline, parameter_deviations(baseline, context.error, context.error.floor))
    shares = prior_shares_of_material(chosen, context.error)
    doubtful = what_is_doubtful_of_material(chosen, shares, misfit_ratio(chosen))
    chosen_material = _chosen_material(verdict, without, considered, settings.conclusions.form_left_open)
    return Diagnosis(
        verdict=verdict.labels,
        probabilities=verdict.probability,
        credible_set=credible,
        chance=multiplicity.chance,
        effects=effects,
        gap=gap_of(before, after, floor, settings.conclusions),
        by_channel=gaps_by_kind(case, before, after, floor),
        by_experiment={
            experiment.name: gap_of([one], [two], floor, settings.conclusions)
            for experiment, one, two in zip(case.experiments, before, after, strict=True)
        },
        gap_at_most=largest_gaps(case, baseline.residual, floor),
        where=where_of(
            case,
            baseline,
            verdict.probability,
            _blocks_of_unknown(comparison, evidence),
            context.catalogue.groups,
            winner,
        ),
        before=without,
        after=over_answers(
            chosen_material, _of_others(considered, without, verdict.labels), verdict.probability
        ),
        cannot_tell=(
            *what_cannot_be_told(effects, credible, measurements(context.catalogue), verdict.doubted),
            *doubtful,
            *dict.fromkeys(filter(None, map(supposed_flat, case.experiments))),
        ),
        next_experiment=advise(context, best_trials(comparison.trials_of_labels), verdict.probability),
        outliers=comparison.outliers,
        errors_left=case.errors_left,
        traces=tuple(
            Trace(experiment, one, two, whitening.deviation, deformed_mesh(case, baseline, number))
            for number, (experiment, one, two, whitening) in enumerate(
                zip(case.experiments, baseline.predicted, chosen.predicted, case.whitenings, strict=True)
            )
        ),
        rivals=rivals,
        considered=considered,
        seconds=0.0,
        prior_shares=shares,
        at_bound=material_at_bound(chosen),
    )


def _blocks_of_unknown(comparison: Comparison, evidence: Mapping[str, float]) -> dict[str, float]:
    """Return the probability of each block, were there something unknown: what any of its effects does, or all do."""
    context = comparison.context
    signatures = [trial.signature for trial in comparison.trials]
    free = context.baseline.free_parameters
    found = evidence_of_blocks(moments_beside(context, signatures), free, signatures, context.error)
    alone = [(trial.signature.effect, trial.log_evidence) for trial in comparison.trials]
    alone += [(one.fit.hypothesis.effects[0], one.log_evidence) for one in comparison.candidates]
    for effect, value in alone:
        found[effect.block.name] = max(found.get(effect.block.name, -np.inf), value)
    return shares_of_unknown(found, temper({**evidence, **found}, context.settings.evidence))


def _material(fit: Linearisation, deviations: FloatArray) -> Material:
    return Material(**material_quantities(fit.hypothesis, fit.free_parameters, deviations))


def _chosen_material(
    verdict: Verdict, without: Material, considered: Mapping[str, Consideration], form_left_open: float
) -> Material:
    """Return E and ν of the verdict, with what it leaves open."""
    tried = [one.achieved.material for one in considered.values() if one.achieved is not None]
    chosen = with_cause_left_open(without, tried if UNKNOWN in verdict.labels else ())
    if verdict.winner is not None:
        fitted = _material(verdict.winner.fit, verdict.winner.deviations)
        chosen = with_form_left_open(fitted, without, form_left_open)
    return chosen


def _of_others(
    considered: Mapping[str, Consideration], baseline: Material, named: Sequence[str]
) -> dict[str, Material]:
    """Return E and ν of every answer but the verdict's."""
    of_causes = {label: (one.achieved or one.expected).material for label, one in considered.items()}
    return {
        label: found
        for label, found in {**of_causes, NONE: baseline}.items()
        if label not in (named or (NONE,))
    }


def _findings(
    comparison: Comparison,
    verdict: Verdict,
    held_out: Sequence[FloatArray],
    floor: float,
    multiplicity: Multiplicity,
) -> dict[str, EffectFinding]:
    context, settings = comparison.context, comparison.context.settings
    winner, probability = verdict.winner, verdict.probability
    fit = winner.fit if winner is not None else context.baseline
    found = {}
    for label, trial in best_trials(comparison.trials).items():
        if label == UNKNOWN and (winner is None or UNKNOWN not in winner.labels):
            continue  # what has no label is told of where it was recognised
        if winner is not None and label in winner.labels:
            without = _without(comparison, winner, label)
            alone = held_out_residuals(without, settings.evidence)
            closure = gap_of(alone, held_out, floor, settings.conclusions).closure_held_out
            found[label] = present_finding(
                winner,
                winner.labels.index(label),
                probability[label],
                without.chi2 - winner.fit.chi2,
                closure if np.isfinite(closure) else None,
                settings.conclusions,
            )
        else:
            found[label] = absent_finding(trial, fit, probability[label], multiplicity, settings.conclusions)
    unseen = [one for one in context.catalogue.effects if one.label not in found]
    found.update({one.label: unseen_finding(one, probability[one.label]) for one in reversed(unseen)})
    return {
        label: replace(one, state="not_solved") if label in comparison.unsolved else one
        for label, one in found.items()
    }


def _without(comparison: Comparison, winner: Candidate, label: str) -> Linearisation:
    """Return the fit with the other causes of the verdict alone, the baseline where there is none."""
    others = tuple(other for other in winner.labels if other != label)
    alone = (one.fit for one in comparison.candidates if one.labels == others)
    return next(alone, comparison.context.baseline)
