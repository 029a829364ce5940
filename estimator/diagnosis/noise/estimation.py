"""What experiments do not state of their noise, found from a misfit: correlation of rows, errors of zero and of rest.

What a model misses is smooth along the rows and over the plane of the beads. So the change of a misfit from row to row
tells the noise, and the correlation by how much less it is than that of white noise. The errors of the beads' rest
positions, the same in every row, show in a mean misfit once polynomials over the plane are taken out; those of the
wrench's zero, which each experiment takes anew, in how the mean misfits of experiments differ. All robustly, since
motion and single beads may be misread.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.settings import NoiseSettings
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

_MEDIAN_OF_A_NORMAL = 0.6745
# Of the smallest so many of normal values, the mean square is this share of the variance.
_KEPT, _MEAN_SQUARE_OF_KEPT = 0.75, 0.3684


@dataclass(frozen=True)
class Noise:
    """What an experiment does not state of its noise.

    Attributes
    ----------
    wrench_correlation, fiducial_correlation : of a reading's noise with that of the row before
    rest_deviation : standard deviation of the beads' rest positions, in units of one reading's noise
    zero_deviation : standard deviation of an experiment's zero of the wrench, in the same units
    """

    wrench_correlation: float = 0.0
    fiducial_correlation: float = 0.0
    rest_deviation: float = 1.0
    zero_deviation: float = 1.0


def noise_of(
    experiments: Sequence[Experiment], misfits: Sequence[FloatArray], settings: NoiseSettings
) -> Noise:
    """Find out about the noise of a case.

    Parameters
    ----------
    misfits : for each experiment (n, 6 + 3m), measured less predicted, in units of the noise; NaN where not measured
    """
    noise = Noise(
        _correlation([misfit[:, :6] for misfit in misfits], settings),
        _correlation([misfit[:, 6:] for misfit in misfits], settings),
    )
    return with_offsets_of(noise, experiments, misfits, settings)


def with_offsets_of(
    noise: Noise, experiments: Sequence[Experiment], misfits: Sequence[FloatArray], settings: NoiseSettings
) -> Noise:
    """Return noise of the same correlation with the errors of zero and of rest of another model's misfits.

    Parameters
    ----------
    misfits : as in :func:`noise_of`
    """
    return replace(
        noise,
        rest_deviation=_rest_deviation(experiments, misfits, noise.fiducial_correlation, settings),
        zero_deviation=_zero_deviation(
            [misfit[:, :6] for misfit in misfits], noise.wrench_correlation, settings
        ),
    )


def _correlation(misfits: Sequence[FloatArray], settings: NoiseSettings) -> float:
    changes = np.concatenate([np.diff(misfit, axis=0).ravel() for misfit in misfits])
    squares = np.sort(changes[np.isfinite(changes)] ** 2)
    if len(squares) == 0:
        return 0.0
    variance = np.mean(squares[: max(1, int(_KEPT * len(squares)))]) / _MEAN_SQUARE_OF_KEPT
    found = float(min(1.0 - variance / 2.0, settings.largest_correlation))
    return found if found > settings.least_correlation else 0.0


def plane_polynomials(rest: FloatArray, length_m: float) -> FloatArray:
    """Return polynomials (m, 6) up to the second degree over the beads' rest positions (m, 3)."""
    beads = max(len(rest), 1)
    x, y = ((rest[:, :2] - rest[:, :2].sum(axis=0) / beads) / length_m).T
    xx, yy = x * x, y * y
    return np.column_stack([np.ones_like(x), x, y, xx - xx.sum() / beads, x * y, yy - yy.sum() / beads])


def _rest_deviation(
    experiments: Sequence[Experiment],
    misfits: Sequence[FloatArray],
    correlation: float,
    settings: NoiseSettings,
) -> float:
    rough, white = [], []
    for experiment, misfit in zip(experiments, misfits, strict=True):
        rest = experiment.fiducials_rest
        beads = misfit[:, 6:].reshape(len(misfit), -1, 3)
        seen = np.isfinite(beads).all(axis=2).sum(axis=0)
        known = seen > 0
        if known.sum() < settings.fewest_beads:
            continue
        mean = np.nanmean(beads[:, known], axis=0)
        basis, _ = np.linalg.qr(plane_polynomials(rest[known], 1.0))
        left = mean - basis @ (basis.T @ mean)
        rough.append(left.ravel() / np.sqrt(1.0 - basis.shape[1] / known.sum()))
        white.append(np.mean(1.0 / seen[known]) * (1.0 + correlation) / (1.0 - correlation))
    if not rough:
        return settings.worst_offset
    return _beyond_white(np.concatenate(rough), float(np.mean(white)), settings)


def _zero_deviation(misfits: Sequence[FloatArray], correlation: float, settings: NoiseSettings) -> float:
    """Return it from how the mean misfits (6,) of experiments differ: a gap that all share does not hide it."""
    readings = np.array([np.isfinite(misfit).sum(axis=0) for misfit in misfits])
    known = readings.all(axis=0)
    if len(misfits) < 2 or not known.any():
        return settings.worst_offset
    means = np.array([np.nanmean(misfit[:, known], axis=0) for misfit in misfits])
    differences = (means - means.mean(axis=0)) / np.sqrt(1.0 - 1.0 / len(means))
    white = np.mean(1.0 / readings[:, known]) * (1.0 + correlation) / (1.0 - correlation)
    return _beyond_white(differences.ravel(), float(white), settings)


def robust_deviation(values: FloatArray) -> float:
    """Return the standard deviation of normal values about zero, whatever a few of them are."""
    return float(np.median(np.abs(values)) / _MEDIAN_OF_A_NORMAL)


def _beyond_white(values: FloatArray, white: float, settings: NoiseSettings) -> float:
    """Return the deviation of values beyond a variance that white noise gives them, robustly.

    Of few values the robust deviation scatters widely, and the root mean square is at most raised by what goes astray:
    of the two the smaller is nearer.
    """
    deviation = min(robust_deviation(values), float(np.sqrt(np.mean(values**2))))
    return float(
        np.clip(np.sqrt(max(deviation**2 - white, 0.0)), settings.best_offset, settings.worst_offset)
    )
