"""What each cause alone would do to the gap: expected to first order, and achieved where it was refitted in full."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.conclusions.findings import effect_quantities, material_quantities
from estimator.diagnosis.conclusions.gap import gap_of
from estimator.diagnosis.evidence.cross_validation import held_out_residuals
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.result import Consideration, Material, Outcome, Place
from estimator.diagnosis.search.candidate import Candidate, parameter_deviations
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.screening import Trial, beside, best_trials

FloatArray = NDArray[np.float64]


def consider(
    context: Context, trials: Sequence[Trial], candidates: Sequence[Candidate], floor: float
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
            _expected(context, trial, floor),
            _achieved(context, refitted[label], floor) if label in refitted else None,
        )
        for label, trial in best_trials(trials).items()
    }


def _expected(context: Context, trial: Trial, floor: float) -> Outcome:
    baseline = context.baseline
    joint = beside(baseline, trial.signature)
    step = np.array([c.of(trial.start).internal - c.internal for c in joint.free_parameters])
    moved = [columns @ step for columns in joint.jacobian]
    change = [whitening.undo(along) for whitening, along in zip(context.case.whitenings, moved, strict=True)]
    channels = tuple(p + c for p, c in zip(baseline.predicted, change, strict=True))
    left = [r - along for r, along in zip(joint.residual, moved, strict=True)]
    deviations = parameter_deviations(joint, context.error, context.error.floor, left)
    return _outcome(context, joint, trial.start, deviations, channels, floor)


def _achieved(context: Context, candidate: Candidate, floor: float) -> Outcome:
    fit = candidate.fit
    return _outcome(context, fit, fit.hypothesis, candidate.deviations, fit.predicted, floor)


def _outcome(
    context: Context,
    fit: Linearisation,
    reached: Hypothesis,
    deviations: FloatArray,
    channels: tuple[FloatArray, ...],
    floor: float,
) -> Outcome:
    evidence = context.settings.evidence
    before, after = held_out_residuals(context.baseline, evidence), held_out_residuals(fit, evidence)
    return Outcome(
        parameters=effect_quantities(reached, fit.free_parameters, deviations, 0),
        material=Material(**material_quantities(reached, fit.free_parameters, deviations)),
        gap=gap_of(before, after, floor, context.settings.conclusions),
        place=_place(context.case, reached),
        channels=channels,
    )


def _place(case: Case, hypothesis: Hypothesis) -> Place | None:
    found = hypothesis.effects[0].place(case.problem, hypothesis.values[0])
    return None if found is None else Place(_xyz(found[0]), found[1])


def _xyz(point: FloatArray) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z
