"""The diagnosis as a whole: where the gap lies, which effect causes it, how far it shrinks with it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from estimator.diagnosis.conclusions.concluding import conclude
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.screened import screened
from estimator.diagnosis.search.baseline import Preparation
from estimator.diagnosis.search.comparison import Comparison, compare
from estimator.diagnosis.search.context import Tell
from estimator.diagnosis.search.decision import reach_verdict, weigh, with_contenders_refitted
from estimator.diagnosis.search.local_resolution import resolved
from estimator.diagnosis.search.racing import polished
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import Catalogue, default_catalogue
from estimator.experiment import Experiment
from estimator.fit.settings import FitSettings
from estimator.forward.advice import advising
from estimator.workers import worker_pool


def diagnose(
    experiments: Sequence[Experiment],
    progress: Tell | None = None,
    *,
    catalogue: Catalogue | None = None,
    settings: DiagnosisSettings | None = None,
    material: FitSettings | None = None,
) -> Diagnosis:
    """Diagnose the gap between the baseline and the experiments of one phantom in one mounting.

    Parameters
    ----------
    experiments : with the same phantom, anchors, grasp and fiducials
    progress : told what is being done, and how much of it is done
    catalogue : the effects that are looked for; the default one with what installed packages add to it
    settings : of every number that is not physics
    material : the tissue's law, and what is known of its parameters beforehand; by default the Neo-Hookean one, of
        which E and ν are fitted. Shape parameters that are not fixed are fitted to a few states, and kept

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
    with advising(experiments), worker_pool() as executor:
        preparation, comparison = screened(
            experiments,
            settings or DiagnosisSettings(),
            catalogue or default_catalogue(),
            material or FitSettings(),
            executor,
            tell,
        )
        _, diagnosis = concluded(preparation, comparison)
        return replace(diagnosis, seconds=time.perf_counter() - started)


def concluded(preparation: Preparation, screened_effects: Comparison) -> tuple[Comparison, Diagnosis]:
    """Refit the leaders of a case that was screened, and conclude; its workers are still there.

    Raises
    ------
    SolverError
        The baseline has no equilibrium.
    """
    comparison = with_contenders_refitted(compare(preparation, screened_effects))
    tell = comparison.context.tell
    evidence = weigh(comparison)
    verdict = reach_verdict(comparison, evidence)
    winner, of_winner = verdict.winner, comparison.context.case
    if winner is not None:
        tell("refitting the cause", 0, 1)
        of_winner, best = resolved(comparison.context, polished(comparison.context, winner))
        tell("refitting the cause", 1, 1)
        candidates = tuple(best if one is winner else one for one in comparison.candidates)
        comparison = replace(comparison, candidates=candidates)
        verdict = replace(verdict, winner=best)
    return comparison, conclude(comparison, evidence, verdict, of_winner)
