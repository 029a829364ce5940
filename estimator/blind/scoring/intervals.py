"""Figures with intervals: shares by Wilson's formula, everything else by the bootstrap."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.inference.normal import Z95

FloatArray = NDArray[np.float64]

CALIBRATION_BINS = 15
_RESAMPLES = 2000
_SEED = 0


@dataclass(frozen=True, slots=True)
class Figure:
    """A value of so many cases, and its 95 % interval; NaN where there is no case."""

    value: float
    low: float
    high: float
    count: int


def share(hits: Sequence[bool]) -> Figure:
    """Return the share of hits with Wilson's score interval (J. Am. Stat. Assoc. 22, 1927, 209–212)."""
    count = len(hits)
    if not count:
        return Figure(math.nan, math.nan, math.nan, 0)
    p = sum(hits) / count
    middle = p + Z95**2 / (2 * count)
    reach = Z95 * math.sqrt(p * (1 - p) / count + Z95**2 / (4 * count**2))
    whole = 1 + Z95**2 / count
    return Figure(p, max(0.0, (middle - reach) / whole), min(1.0, (middle + reach) / whole), count)


def bootstrapped(statistic: Callable[[FloatArray], FloatArray], cases: FloatArray) -> Figure:
    """Return a statistic of cases (n, k) with its percentile bootstrap interval, the same at every call.

    Parameters
    ----------
    statistic : takes sets of cases (b, n, k) to their values (b,)
    """
    count = len(cases)
    if not count:
        return Figure(math.nan, math.nan, math.nan, 0)
    drawn = np.random.default_rng(_SEED).integers(count, size=(_RESAMPLES, count))
    low, high = np.percentile(statistic(cases[drawn]), [2.5, 97.5])
    return Figure(float(statistic(cases[None])[0]), float(low), float(high), count)


def quantile(values: Sequence[float], percentile: float) -> Figure:
    """Return a percentile of values with its bootstrap interval."""
    return bootstrapped(lambda sets: np.percentile(sets[:, :, 0], percentile, axis=1), _column(values))


def mean(values: Sequence[float]) -> Figure:
    """Return the mean of values with its bootstrap interval."""
    return bootstrapped(lambda sets: sets[:, :, 0].mean(axis=1), _column(values))


def calibration_error(confidence: Sequence[float], right: Sequence[bool]) -> Figure:
    """Return the expected calibration error in bins of equal width (Guo et al., ICML 2017) with its interval."""
    return bootstrapped(_calibration_error, np.column_stack([confidence, right]).astype(np.float64))


def calibration_error_by_chance(confidence: Sequence[float]) -> float | None:
    """Return the mean calibration error of answers right exactly as often as they claim; None without answers.

    Few cases show an error even of probabilities that have none (Bröcker & Smith, Weather Forecast. 22 (2007) 651).
    """
    if not confidence:
        return None
    claimed = np.broadcast_to(np.asarray(confidence, dtype=np.float64), (_RESAMPLES, len(confidence)))
    right = np.random.default_rng(_SEED).random(claimed.shape) < claimed
    return float(_calibration_error(np.stack([claimed, right], axis=-1)).mean())


def _calibration_error(sets: FloatArray) -> FloatArray:
    """Return the calibration error (b,) of sets (b, n, 2) of claimed probability and whether it was right."""
    claimed, hit = sets[:, :, 0], sets[:, :, 1]
    of_bin = np.minimum((claimed * CALIBRATION_BINS).astype(np.int64), CALIBRATION_BINS - 1)
    off = [np.where(of_bin == b, hit - claimed, 0.0).sum(axis=1) for b in range(CALIBRATION_BINS)]
    return np.asarray(np.abs(off).sum(axis=0) / sets.shape[1])


def _column(values: Sequence[float]) -> FloatArray:
    return np.array(values, dtype=np.float64)[:, None]
