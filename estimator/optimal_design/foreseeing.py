"""What each answer foresees of an experiment that is planned: whitened data, forces, and what the experiment is worth.

To first order beside the fitted baseline, as causes are screened: an answer's parameters times the derivatives of the
planned rows. That is inexact by a share of what the cause changes, which counts as a smooth misfit along the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.conclusions.rehearsal import Rehearsal, rehearsed
from estimator.diagnosis.evidence.discrepancy import discrepancy_of
from estimator.diagnosis.fitting.case import Case
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.settings import EvidenceSettings
from estimator.experiment import Experiment
from estimator.inference.channels import measured_rows
from estimator.inference.whitening import Whitening
from estimator.optimal_design.beliefs import Belief
from estimator.optimal_design.information import Predictive
from estimator.optimal_design.unstrained import (
    unstrained_channels,
    unstrained_signature,
    unstrained_whitening,
)

FloatArray = NDArray[np.float64]

# Share of what a cause changes by which its first order may be off, for each of so many cosines along the rows.
_INEXACT = 0.1
# The same where a device is looked at by itself: another form of the cause may fit the tissue's data as well.
_INEXACT_IN_ANOTHER_FORM = 0.3
_WAVES = 3
# By how many deviations of what is foreseen the largest force may be exceeded.
_DEVIATIONS = 2.0


@dataclass(frozen=True, eq=False)
class Foresight:
    """What is foreseen of an experiment.

    Attributes
    ----------
    by_answer : what each belief foresees, in one whitening
    largest_force, largest_torque : N and N·m, of all answers, two deviations included
    """

    by_answer: tuple[Predictive, ...]
    largest_force: float
    largest_torque: float


def foresee(
    case: Case, baseline: Hypothesis, beliefs: Sequence[Belief], planned: Experiment
) -> Foresight | None:
    """Foresee an experiment in which the gripper moves tissue; None where the baseline has no equilibrium in it."""
    with_cause = [one for one in beliefs if one.effect is not None]
    plans = [(one.effect, one.constants) for one in with_cause if one.effect is not None]
    rehearsal = rehearsed(case, baseline, planned, plans)
    if rehearsal is None:
        return None
    columns = {
        one.label: signature.columns[0]
        for one, signature in zip(with_cause, rehearsal.signatures, strict=True)
    }
    smooth = _smooth(rehearsal.experiment, rehearsal.whitening, case.settings.evidence)
    found = [
        _predictive(
            one, rehearsal.by_material, columns.get(one.label), (rehearsal.whitening, smooth), _INEXACT
        )
        for one in beliefs
    ]
    return Foresight(tuple(found), *_largest(rehearsal, beliefs, found))


def foresee_unstrained(
    comparison: Comparison, beliefs: Sequence[Belief], planned: Experiment, *, unknown_shows: bool = False
) -> tuple[Predictive, ...]:
    """Foresee an experiment in which no tissue is strained, measured in what is finite of ``planned``.

    Something unknown may sit in the tissue, and show nothing then, or in a device: ``unknown_shows``.
    """
    baseline, case = comparison.context.baseline, comparison.context.case
    whitening = unstrained_whitening(planned)
    by_material = np.zeros((int(whitening.seen.sum()), len(baseline.free_parameters)))
    smooth = _smooth(planned, whitening, case.settings.evidence)
    shown = smooth if unknown_shows else smooth[:, :0]
    columns = {
        one.label: unstrained_signature(planned, baseline.hypothesis, one.effect, one.constants)
        for one in beliefs
        if one.effect is not None
    }
    return tuple(
        _predictive(one, by_material, columns.get(one.label), (whitening, shown), _INEXACT_IN_ANOTHER_FORM)
        for one in beliefs
    )


def seen_unstrained(comparison: Comparison, measured: Experiment) -> FloatArray:
    """Return the whitened departure (r,) of such an experiment from what the baseline's sensors would read."""
    expected = unstrained_channels(measured, comparison.context.baseline.hypothesis)
    return unstrained_whitening(measured).residual(measured_rows(measured), expected)


def _predictive(
    belief: Belief,
    by_material: FloatArray,
    by_cause: FloatArray | None,
    seen: tuple[Whitening, FloatArray],
    inexact: float,
) -> Predictive:
    """Foresee an experiment under an answer; ``seen``: its whitening, and directions of a smooth misfit (r, q)."""
    whitening, smooth = seen
    columns = by_material if by_cause is None else np.column_stack([by_material, by_cause])
    spread = [columns @ belief.root]
    if by_cause is not None:
        changed = by_cause @ belief.mean[by_material.shape[1] :]
        spread.append(inexact * changed[:, None] * _waves_of(whitening))
    if belief.unexplained:
        spread.append(belief.unexplained * smooth)
    return Predictive(columns @ belief.mean, np.hstack(spread))


def _smooth(experiment: Experiment, whitening: Whitening, settings: EvidenceSettings) -> FloatArray:
    """Return directions (r, q) of a smooth misfit of the size of a reading's noise."""
    process = discrepancy_of(experiment, whitening, settings)
    return np.hstack([v * np.sqrt(e) for v, e in zip(process.vectors, process.eigenvalues, strict=True)])


def _waves_of(whitening: Whitening) -> FloatArray:
    """Return cosines along the rows (r, 2 w), of wrench and of fiducials apart."""
    rows, channels = np.nonzero(whitening.seen)
    phase = (rows + 0.5) / len(whitening.seen)
    waves = np.cos(np.pi * np.outer(phase, np.arange(_WAVES)))
    of_wrench = (channels < 6)[:, None]
    return np.hstack([np.where(of_wrench, waves, 0.0), np.where(of_wrench, 0.0, waves)])


def _largest(
    rehearsal: Rehearsal, beliefs: Sequence[Belief], foreseen: Sequence[Predictive]
) -> tuple[float, float]:
    """Return the largest force and torque in any row under any answer, N and N·m."""
    experiment, whitening = rehearsal.experiment, rehearsal.whitening
    found = np.zeros(2)
    for belief, one in zip(beliefs, foreseen, strict=True):
        change = whitening.undo(one.mean)[:, :6]
        variance = np.full_like(change, belief.unexplained**2) * whitening.deviation[:6] ** 2
        # A smooth misfit that nothing explains is reckoned with by its size alone.
        of_parameters = len(belief.root) + (0 if belief.effect is None else 2 * _WAVES)
        for column in one.spread[:, :of_parameters].T:
            variance += whitening.undo(column)[:, :6] ** 2
        reach = np.abs(experiment.wrench + change) + _DEVIATIONS * np.sqrt(variance)
        found = np.maximum(
            found, [np.linalg.norm(part, axis=1).max() for part in (reach[:, :3], reach[:, 3:])]
        )
    return float(found[0]), float(found[1])
