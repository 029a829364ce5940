"""The first look at a case: the fitted baseline, and every effect of the catalogue to first order beside it."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace

from estimator.diagnosis.evidence.marginal_likelihood import (
    error_borne_out,
    evidence_of_unknown,
    first_order_evidence,
)
from estimator.diagnosis.evidence.noise_selection import most_probable_noise, refitted_anew
from estimator.diagnosis.noise.errors_left import AT_MOST
from estimator.diagnosis.noise.outliers import number_left_out
from estimator.diagnosis.search.baseline import Preparation, prepare
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.context import Context, Tell
from estimator.diagnosis.search.screening import is_of_this_rig, screen
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import Catalogue
from estimator.experiment import Experiment
from estimator.fit.settings import FitSettings


def screened(
    experiments: Sequence[Experiment],
    settings: DiagnosisSettings,
    catalogue: Catalogue,
    material: FitSettings,
    executor: Executor,
    tell: Tell,
) -> tuple[Preparation, Comparison]:
    """Fit the baseline, then let every effect of the catalogue explain to first order what it leaves.

    Parameters
    ----------
    material : the baseline's law, and what is known of its parameters beforehand

    Raises
    ------
    InputError, FitError, SolverError
        As :func:`estimator.diagnosis.diagnose.diagnose`.
    """
    tell("fitting the baseline", 0, 1)
    preparation, baseline = prepare(experiments, settings, material, executor)
    tell("fitting the baseline", 1, 1)
    lenient = preparation.cases(AT_MOST)
    case = most_probable_noise(preparation.cases, lenient, baseline)
    baseline = refitted_anew(baseline, lenient, case)
    error = error_borne_out(case, baseline)
    none, unknown = first_order_evidence(case, baseline, error), evidence_of_unknown(case, baseline, error)
    asked = tuple(effect for effect in catalogue.effects if is_of_this_rig(effect, case))
    catalogue = replace(catalogue, effects=asked).looked_for_in(experiments)
    everything = (*catalogue.effects, *catalogue.outsiders)
    plain = [effect for effect in everything if not (effect.elaborates or effect.mistaken_for)]
    context = Context(case, baseline, error, executor, tell, catalogue)
    trials = screen(context, plain)
    left_out = number_left_out(experiments, case.experiments)
    return preparation, Comparison(context, left_out, tuple(trials), (), none, unknown)
