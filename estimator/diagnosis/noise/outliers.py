"""Single readings of a bead that are wild: a reflection taken for it, for one image.

The misfit of a bead is smooth along the rows but for noise, whatever the model leaves out, and where the motion turns
that of all beads turns with it. A reading far from the median of the two before and the two after it, where those agree
with each other, and not like those of the other beads, is left out. A bead that is read falsely from some row on is no
glitch.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.settings import NoiseSettings
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

# Of x_t less the median of four neighbours, whose variance is 0.298, for unit white noise.
_SPREAD = np.sqrt(1.298)
_TO_DEVIATION = 1.4826


def without_outliers(
    experiments: Sequence[Experiment], misfits: Sequence[FloatArray], settings: NoiseSettings
) -> tuple[Experiment, ...]:
    """Return the experiments with NaN for the readings of beads that are wild.

    Parameters
    ----------
    misfits : for each experiment (n, 6 + 3m), measured less predicted in units of the noise, NaN where not measured
    """
    return tuple(
        replace(e, fiducials=np.where(_outliers(misfit[:, 6:], settings)[:, :, None], np.nan, e.fiducials))
        for e, misfit in zip(experiments, misfits, strict=True)
    )


def number_left_out(given: Sequence[Experiment], kept: Sequence[Experiment]) -> int:
    """Return how many readings of a bead the kept experiments lack; both in any order."""
    return _readings(given) - _readings(kept)


def _readings(experiments: Sequence[Experiment]) -> int:
    return sum(int(np.isfinite(each.fiducials).all(axis=2).sum()) for each in experiments)


def _outliers(misfit: FloatArray, settings: NoiseSettings) -> NDArray[np.bool_]:
    """Tell which bead is wild in which row (n, m), of a misfit (n, 3m)."""
    beads = misfit.reshape(len(misfit), -1, 3)
    if len(beads) < 3 or not beads.size:
        return np.zeros(beads.shape[:2], dtype=bool)
    count = settings.neighbours
    before, after = _neighbours(beads, count), _neighbours(beads[::-1], count)[:, ::-1]
    off = beads - _nan_median(np.concatenate([before, after]))
    middle = _nan_median(off.swapaxes(0, 1))[:, None]
    spread = _TO_DEVIATION * _nan_median(np.abs(off - middle).swapaxes(0, 1))[:, None]
    far = np.abs(off - middle) > settings.outlier * np.maximum(settings.outlier_scatter * spread, _SPREAD)
    # Beside the first row and the last there is nothing to agree with: no cause shows in one row alone either.
    apart = np.abs(_nan_mean(after) - _nan_mean(before)) >= settings.outlier
    return np.asarray((far & ~apart).any(axis=2))


def _neighbours(beads: FloatArray, count: int) -> FloatArray:
    """Return the readings (k, n, m, 3) of the rows before each; NaN where there is none."""
    padded = np.concatenate([np.full((count, *beads.shape[1:]), np.nan), beads])
    return np.stack([padded[back : back + len(beads)] for back in range(count)])


def _nan_median(values: FloatArray) -> FloatArray:
    """Return the median along the first axis of what is there; NaN where nothing is, without a warning."""
    some = np.isfinite(values).any(axis=0)
    return np.where(some, np.nanmedian(np.where(some, values, 0.0), axis=0), np.nan)


def _nan_mean(values: FloatArray) -> FloatArray:
    """Return the mean in the same way."""
    some = np.isfinite(values).any(axis=0)
    return np.where(some, np.nanmean(np.where(some, values, 0.0), axis=0), np.nan)
