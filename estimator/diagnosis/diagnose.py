"""The diagnosis as a whole: where the gap lies, which effect causes it, how far it shrinks with it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from estimator.diagnosis.conclusions.deformation import deformed_mesh
from estimator.diagnosis.conclusions.design_of_experiments import advise
from estimator.diagnosis.conclusions.findings import absent_finding, material_quantities, present_finding
from estimator.diagnosis.conclusions.gap import gap_of, gaps_by_kind
from estimator.diagnosis.conclusions.localisation import where_of
from estimator.diagnosis.conclusions.model_averaging import (
    over_answers,
    with_cause_left_open,
    with_form_left_open,
)
from estimator.diagnosis.conclusions.multiple_testing import Multiplicity, multiplicity_of, rivals_of
from estimator.diagnosis.conclusions.open_questions import what_cannot_be_told
from estimator.diagnosis.conclusions.what_if import consider
from estimator.diagnosis.evidence.cross_validation import held_out_in_full, held_out_residuals
from estimator.diagnosis.evidence.noise_floor import noise_floor
from estimator.diagnosis.evidence.posterior import credible_set, temper
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.result import Consideration, Diagnosis, EffectFinding, Material, Trace
from estimator.diagnosis.search.candidate import Candidate, parameter_deviations
from estimator.diagnosis.search.comparison import Comparison, compare
from estimator.diagnosis.search.decision import Verdict, reach_verdict, weigh
from estimator.diagnosis.search.local_resolution import resolved
from estimator.diagnosis.search.racing import polished
from estimator.diagnosis.search.screening import Tell, best_trials
from estimator.effects.catalogue import LABELS
from estimator.experiment import Experiment
from estimator.workers import worker_pool

FloatArray = NDArray[np.float64]


def diagnose(experiments: Sequence[Experiment], progress: Tell | None = None) -> Diagnosis:
    """Diagnose the gap between the baseline and the experiments of one phantom in one mounting.

    Parameters
    ----------
    experiments : with the same phantom, anchors, grasp and fiducials
    progress : told what is being done, and how much of it is done

    Raises
    ------
    InputError
        The phantom cannot be meshed.
    FitError
        The baseline cannot be fitted.
    SolverError
        The baseline has no equilibrium.
    """
    started = time.perf_counter()
    tell = progress or (lambda stage, done, total: None)
    with worker_pool() as executor:
        comparison = compare(experiments, executor, tell)
        evidence = weigh(comparison)
        verdict = reach_verdict(comparison, evidence, executor, tell)
        winner, case = verdict.winner, comparison.case
        if winner is not None:
            tell("refitting the cause", 0, 1)
            best = polished(case, comparison.baseline, comparison.error, winner, executor)
            case, best = resolved(case, comparison.baseline, comparison.error, best, executor)
            tell("refitting the cause", 1, 1)
            comparison = replace(
                comparison, candidates=tuple(best if one is winner else one for one in comparison.candidates)
            )
            verdict = replace(verdict, winner=best)
        return _diagnosis(comparison, evidence, verdict, case, started, executor, tell)


def _diagnosis(
    comparison: Comparison,
    evidence: Mapping[str, float],
    verdict: Verdict,
    of_winner: Case,
    started: float,
    executor: Executor,
    tell: Tell,
) -> Diagnosis:
    """Tell of a contest; ``of_winner`` is the case in which the winner was refitted."""
    case, baseline, winner = comparison.case, comparison.baseline, verdict.winner
    chosen = winner.fit if winner is not None else baseline
    before = held_out_residuals(baseline)
    after = before if winner is None else held_out_in_full(of_winner, chosen, executor)
    floor = noise_floor(
        case,
        (winner or comparison.candidates[0]).fit if comparison.candidates else baseline,
        comparison.error,
    )
    gap = gap_of(before, after, floor)
    rivals, seen = rivals_of(baseline, comparison.trials, comparison.error)
    multiplicity = multiplicity_of(rivals, seen)
    effects = _findings(comparison, verdict, after, floor, multiplicity)
    shares = softmax(temper(evidence) * np.array([evidence[label] for label in LABELS]))
    where = where_of(
        case, baseline, verdict.probability, dict(zip(LABELS, shares, strict=True)), LABELS, winner
    )
    alone = parameter_deviations(baseline, comparison.error, comparison.error.floor)
    credible = credible_set(verdict.probability)
    considered = consider(
        case, baseline, comparison.error, comparison.trials_of_labels, comparison.candidates, floor
    )
    without = _material(baseline, alone)
    if winner is not None:
        chosen_material = with_form_left_open(_material(chosen, winner.deviations), without)
    elif UNKNOWN in verdict.labels:
        tried = [one.achieved.material for one in considered.values() if one.achieved is not None]
        chosen_material = with_cause_left_open(without, tried)
    else:
        chosen_material = without
    return Diagnosis(
        verdict=verdict.labels,
        probabilities=verdict.probability,
        credible_set=credible,
        chance=multiplicity.chance,
        effects=effects,
        gap=gap,
        by_channel=gaps_by_kind(case, before, after, floor),
        by_experiment={
            experiment.name: gap_of([one], [two], floor)
            for experiment, one, two in zip(case.experiments, before, after, strict=True)
        },
        where=where,
        before=without,
        after=over_answers(
            chosen_material, _of_others(considered, without, verdict.labels), verdict.probability
        ),
        cannot_tell=what_cannot_be_told(effects, credible, verdict.doubted),
        next_experiment=advise(
            case, baseline, best_trials(comparison.trials_of_labels), verdict.probability, executor, tell
        ),
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
        seconds=time.perf_counter() - started,
    )


def _material(fit: Linearisation, deviations: FloatArray) -> Material:
    return Material(**material_quantities(fit.hypothesis, fit.free_parameters, deviations))


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
    winner, probability = verdict.winner, verdict.probability
    fit = winner.fit if winner is not None else comparison.baseline
    found = {}
    for label, trial in best_trials(comparison.trials).items():
        if label == UNKNOWN and (winner is None or UNKNOWN not in winner.labels):
            continue  # what has no label is told of where it was recognised
        if winner is not None and label in winner.labels:
            without = _without(comparison, winner, label)
            closure = gap_of(held_out_residuals(without), held_out, floor).closure_held_out
            found[label] = present_finding(
                winner,
                winner.labels.index(label),
                probability[label],
                without.chi2 - winner.fit.chi2,
                closure if np.isfinite(closure) else None,
            )
        else:
            found[label] = absent_finding(trial, fit, probability[label], multiplicity)
    return found


def _without(comparison: Comparison, winner: Candidate, label: str) -> Linearisation:
    """Return the fit with the other causes of the verdict alone, the baseline where there is none."""
    others = tuple(other for other in winner.labels if other != label)
    alone = (one.fit for one in comparison.candidates if one.labels == others)
    return next(alone, comparison.baseline)
