"""What each cause alone would do to the gap: expected to first order, and achieved where it was refitted in full."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.conclusions.findings import effect_quantities, material_quantities
from estimator.diagnosis.conclusions.gap import gap_of
from estimator.diagnosis.evidence.cross_validation import held_out_residuals
from estimator.diagnosis.evidence.discrepancy import ModelError
from estimator.diagnosis.evidence.marginal_likelihood import error_borne_out, first_order_evidence
from estimator.diagnosis.evidence.noise_selection import in_another_case, refitted_anew, signatures_anew
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.noise.errors_left import AT_MOST, ErrorsLeft
from estimator.diagnosis.result import Consideration, Material, Outcome, Place
from estimator.diagnosis.search.baseline import corrected_at_best, prepare
from estimator.diagnosis.search.candidate import Candidate, parameter_deviations
from estimator.diagnosis.search.local_resolution import resolved
from estimator.diagnosis.search.racing import race, race_on
from estimator.diagnosis.search.screening import (
    Tell,
    Trial,
    beside,
    best_starts,
    best_trials,
    screen,
    trials_of,
)
from estimator.effects.catalogue import CATALOGUE, LABELS
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.workers import worker_pool

FloatArray = NDArray[np.float64]

_STARTS = 3


def consider(
    case: Case,
    baseline: Linearisation,
    error: ModelError,
    trials: Sequence[Trial],
    candidates: Sequence[Candidate],
    floor: float,
) -> dict[str, Consideration]:
    """Return for every label of the trials what its best form would do alone beside the baseline.

    ``floor`` is the root mean square of the noise in the whitened misfit.
    """
    refitted: dict[str, Candidate] = {}
    for candidate in candidates:
        if len(candidate.labels) == 1:
            refitted.setdefault(candidate.labels[0], candidate)
    return {
        label: Consideration(
            _expected(case, baseline, error, trial, floor),
            _achieved(case, baseline, refitted[label], floor) if label in refitted else None,
        )
        for label, trial in best_trials(trials).items()
    }


def what_if(
    experiments: Sequence[Experiment],
    label: str,
    floor: float,
    errors_left: ErrorsLeft,
    progress: Tell | None = None,
) -> Consideration:
    """Fit a model with one cause to experiments of one phantom in one mounting, however improbable it is.

    Parameters
    ----------
    experiments : as for :func:`estimator.diagnosis.diagnose.diagnose`
    label : of the catalogue
    floor : root mean square of the noise alone, as the diagnosis of these experiments has it (``gap.floor``)
    errors_left : how much of the errors that rows may share it took for noise, likewise
    progress : told what is being done, and how much of it is done

    Raises
    ------
    InputError
        The catalogue has no such label, or the phantom cannot be meshed.
    FitError
        The baseline cannot be fitted.
    SolverError
        The baseline has no equilibrium.
    """
    if label not in LABELS:
        raise InputError(f"{label}: is no cause of the catalogue; choose one of {', '.join(LABELS)}")
    tell = progress or (lambda stage, done, total: None)
    with worker_pool() as executor:
        tell("fitting the baseline", 0, 1)
        preparation, baseline = prepare(experiments, executor)
        case = preparation.cases(errors_left)
        baseline = refitted_anew(baseline, preparation.cases(AT_MOST), case)
        error = error_borne_out(case, baseline)
        forms = [effect for effect in CATALOGUE if effect.label == label and not effect.elaborates]
        trials = screen(case, baseline, error, forms, executor, tell)
        starts = [trial.start for trial in best_starts(trials)[:_STARTS]]
        candidates = race(case, baseline, error, starts, -np.inf, executor, tell)
        none = first_order_evidence(case, baseline, error)
        corrected = corrected_at_best(preparation, case, candidates, none, executor)
        if corrected is not preparation:
            before, case = case, corrected.cases(errors_left)
            baseline = refitted_anew(baseline, before, case)
            error = error_borne_out(case, baseline)
            signatures = signatures_anew([trial.signature for trial in trials], before, case)
            trials = trials_of(case, baseline, error, signatures)
            fits = [in_another_case(one.fit, before, case) for one in candidates]
            candidates = race_on(case, baseline, error, fits, -np.inf, executor, tell)
        best = [resolved(case, baseline, error, one, executor)[1] for one in candidates[:1]]
        return consider(case, baseline, error, trials, [*best, *candidates[1:]], floor)[label]


def _expected(case: Case, baseline: Linearisation, error: ModelError, trial: Trial, floor: float) -> Outcome:
    joint = beside(baseline, trial.signature)
    step = np.array([c.get(trial.start) - c.get(joint.hypothesis) for c in joint.free_parameters])
    change = [
        whitening.undo(columns @ step)
        for whitening, columns in zip(case.whitenings, joint.jacobian, strict=True)
    ]
    channels = tuple(p + c for p, c in zip(baseline.predicted, change, strict=True))
    deviations = parameter_deviations(joint, error, error.floor)
    return _outcome(case, baseline, joint, trial.start, deviations, channels, floor)


def _achieved(case: Case, baseline: Linearisation, candidate: Candidate, floor: float) -> Outcome:
    fit = candidate.fit
    return _outcome(case, baseline, fit, fit.hypothesis, candidate.deviations, fit.predicted, floor)


def _outcome(
    case: Case,
    baseline: Linearisation,
    fit: Linearisation,
    reached: Hypothesis,
    deviations: FloatArray,
    channels: tuple[FloatArray, ...],
    floor: float,
) -> Outcome:
    return Outcome(
        parameters=effect_quantities(reached, fit.free_parameters, deviations, 0),
        material=Material(**material_quantities(reached, fit.free_parameters, deviations)),
        gap=gap_of(held_out_residuals(baseline), held_out_residuals(fit), floor),
        place=_place(case, reached),
        channels=channels,
    )


def _place(case: Case, hypothesis: Hypothesis) -> Place | None:
    found = hypothesis.effects[0].place(case.problem, hypothesis.values[0])
    if found is None:
        return None
    x, y, z = found[0].tolist()
    return Place((x, y, z), found[1])
