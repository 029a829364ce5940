"""The diagnosis with one cause alone, however improbable it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.conclusions.single_causes import consider
from estimator.diagnosis.evidence.marginal_likelihood import error_borne_out, first_order_evidence
from estimator.diagnosis.evidence.noise_selection import in_another_case, refitted_anew, signatures_anew
from estimator.diagnosis.noise.errors_left import AT_MOST, ErrorsLeft
from estimator.diagnosis.result import Consideration
from estimator.diagnosis.search.baseline import corrected_at_best, prepare
from estimator.diagnosis.search.context import Context, Tell
from estimator.diagnosis.search.local_resolution import resolved
from estimator.diagnosis.search.racing import race, race_on
from estimator.diagnosis.search.screening import best_starts, screen, trials_of
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import Catalogue, default_catalogue
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fit.settings import FitSettings
from estimator.workers import worker_pool


def what_if(
    experiments: Sequence[Experiment],
    label: str,
    floor: float,
    errors_left: ErrorsLeft,
    progress: Tell | None = None,
    *,
    catalogue: Catalogue | None = None,
) -> Consideration:
    """Fit a model with one cause to experiments of one phantom in one mounting, however improbable it is.

    Parameters
    ----------
    experiments : as for :func:`estimator.diagnosis.diagnose.diagnose`
    label : of the catalogue
    floor : root mean square of the noise alone, as the diagnosis of these experiments has it (``gap.floor``)
    errors_left : how much of the errors that rows may share it took for noise, likewise
    progress : told what is being done, and how much of it is done
    catalogue : by default that of the diagnosis

    Raises
    ------
    InputError
        The catalogue has no such label, or the phantom cannot be meshed.
    FitError
        The baseline cannot be fitted.
    SolverError
        The baseline has no equilibrium.
    """
    settings = DiagnosisSettings()
    catalogue = (catalogue or default_catalogue()).looked_for_in(experiments)
    if label not in catalogue.labels:
        raise InputError(
            f"{label}: is no cause of the catalogue; choose one of {', '.join(catalogue.labels)}"
        )
    tell = progress or (lambda stage, done, total: None)
    with worker_pool() as executor:
        tell("fitting the baseline", 0, 1)
        preparation, baseline = prepare(experiments, settings, FitSettings(), executor)
        case = preparation.cases(errors_left)
        baseline = refitted_anew(baseline, preparation.cases(AT_MOST), case)
        context = Context(case, baseline, error_borne_out(case, baseline), executor, tell, catalogue)
        forms = [effect for effect in catalogue.forms(label) if not effect.elaborates]
        trials = screen(context, forms)
        if not trials:
            raise InputError(
                f"{label}: would not show, for what it acts on is not there or was not measured; choose another cause"
            )
        starts = [trial.start for trial in best_starts(trials, settings.search.starts)]
        candidates = race(context, starts[: settings.conclusions.starts_of_what_if], -np.inf)
        none = first_order_evidence(case, baseline, context.error)
        corrected = corrected_at_best(preparation, context, candidates, none)
        if corrected is not preparation:
            case = corrected.cases(errors_left)
            baseline = refitted_anew(baseline, context.case, case)
            signatures = signatures_anew([trial.signature for trial in trials], context.case, case)
            fits = [in_another_case(one.fit, context.case, case) for one in candidates]
            context = replace(context, case=case, baseline=baseline, error=error_borne_out(case, baseline))
            trials = trials_of(context, signatures)
            candidates = race_on(context, fits, -np.inf)
        best = [resolved(context, one)[1] for one in candidates[:1]]
        return consider(context, trials, [*best, *candidates[1:]], floor)[label]
