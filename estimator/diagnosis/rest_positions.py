"""How well the beads' rest positions are known: each has an error of its own, the same in every row.

What a model misses is smooth over the plane of the beads; the errors of their rest positions are not. So a mean misfit
is freed of polynomials over the plane, and the rest tells the errors, robustly, since one bead may be misread.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

# In units of one reading's noise: nobody places beads better, and who places them worse finds some effects less easily.
_BEST, _WORST = 0.1, 1.0
_MEDIAN_OF_A_NORMAL = 0.6745
_FEWEST_BEADS = 8


def plane_polynomials(rest: FloatArray, length_m: float) -> FloatArray:
    """Return polynomials (m, 6) up to the second degree over the beads' rest positions (m, 3)."""
    x, y = ((rest[:, :2] - rest[:, :2].mean(axis=0)) / length_m).T
    return np.column_stack([np.ones_like(x), x, y, x * x - (x * x).mean(), x * y, y * y - (y * y).mean()])


def rest_deviation(experiments: Sequence[Experiment], misfits: Sequence[FloatArray]) -> float:
    """Return the standard deviation of the beads' rest positions in units of one reading's noise.

    Parameters
    ----------
    misfits : for each experiment (n, 6 + 3m), measured less predicted, in units of the noise; NaN where not measured
    """
    rough, white = [], []
    for experiment, misfit in zip(experiments, misfits, strict=True):
        rest = experiment.fiducials_rest
        beads = misfit[:, 6:].reshape(len(misfit), -1, 3)
        seen = np.isfinite(beads).all(axis=2).sum(axis=0)
        known = seen > 0
        if known.sum() < _FEWEST_BEADS:
            continue
        mean = np.nanmean(beads[:, known], axis=0)
        basis, _ = np.linalg.qr(plane_polynomials(rest[known], 1.0))
        left = mean - basis @ (basis.T @ mean)
        rough.append(left.ravel() / np.sqrt(1.0 - basis.shape[1] / known.sum()))
        white.append(np.mean(1.0 / seen[known]))
    if not rough:
        return _WORST
    deviation = np.median(np.abs(np.concatenate(rough))) / _MEDIAN_OF_A_NORMAL
    return float(np.clip(np.sqrt(max(deviation**2 - np.mean(white), 0.0)), _BEST, _WORST))
