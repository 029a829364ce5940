"""Residuals of one experiment without and with the causes, in units of the noise, by channel and stretch of motion."""

from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.result import Trace
from estimator.experiment import Experiment
from estimator.report.channels import CHANNELS, root_mean_square
from estimator.report.drawing.scene import MM, farthest_row

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Stretch:
    """Consecutive rows of one step and phase."""

    step: int
    phase: str
    rows: slice


def stretches(experiment: Experiment) -> list[Stretch]:
    """Return the stretches of an experiment in their order."""
    found = []
    row = 0
    for (step, phase), rows in groupby(zip(experiment.step, experiment.phase, strict=True)):
        end = row + len(list(rows))
        found.append(Stretch(int(step), phase, slice(row, end)))
        row = end
    return found


def measured_channels(experiment: Experiment) -> FloatArray:
    """Return wrench and fiducials side by side, (n, 6 + 3m)."""
    return np.hstack([experiment.wrench, experiment.fiducials.reshape(len(experiment.time), -1)])


def residual_sigma(trace: Trace, predicted: FloatArray) -> FloatArray:
    """Return measured minus predicted (n, 6 + 3m) in units of the noise; NaN where nothing was measured."""
    return (measured_channels(trace.experiment) - predicted) / trace.deviation


def residual_map(trace: Trace, predicted: FloatArray) -> FloatArray:
    """Return the root mean square residual (9, s), in units of the noise, of ``CHANNELS`` in every stretch."""
    residual = residual_sigma(trace, predicted)
    columns = [[i] for i in range(6)] + [list(range(6 + axis, residual.shape[1], 3)) for axis in range(3)]
    return np.array(
        [
            [
                root_mean_square(residual[stretch.rows][:, of_channel])
                for stretch in stretches(trace.experiment)
            ]
            for of_channel in columns[: len(CHANNELS)]
        ]
    )


def farthest_fiducials_mm(trace: Trace, predicted: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where the fiducials were at the farthest state, and measured minus predicted there, (m, 3) each, mm."""
    row = farthest_row(trace.experiment)
    measured = trace.experiment.fiducials[row]
    return MM * measured, MM * (measured - predicted[row, 6:].reshape(-1, 3))
