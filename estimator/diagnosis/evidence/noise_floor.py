"""What of a misfit is noise alone."""

from __future__ import annotations

import numpy as np

from estimator.diagnosis.evidence.discrepancy import ModelError
from estimator.diagnosis.fitting.case import Case, Linearisation


def noise_floor(case: Case, fit: Linearisation, error: ModelError) -> float:
    """Return the root mean square of the noise over all experiments, as the misfit of the best fit shows it.

    What a model misses is smooth along the experiment and over the plane; the rest of the misfit is noise, together
    with the errors that rows share (tare, rest positions, reported poses) as large as they really were. It lies between
    the white noise alone and all that is stated.
    """
    squares, count = 0.0, 0
    for residual, process in zip(fit.residual, error.processes, strict=True):
        smooth, _ = np.linalg.qr(np.hstack(process.vectors))
        rough = residual - smooth @ (smooth.T @ residual)
        squares += float(rough @ rough)
        count += len(rough) - smooth.shape[1]
    return float(np.clip(np.sqrt(squares / max(count, 1)), white_floor(case), 1.0))


def white_floor(case: Case) -> float:
    """Return the root mean square over all experiments of the white noise alone."""
    squares = [w.floor**2 for w in case.whitenings]
    return float(np.sqrt(np.average(squares, weights=[len(w.vectors) for w in case.whitenings])))
