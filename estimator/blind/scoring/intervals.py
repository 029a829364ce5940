"""Figures with intervals: shares by Wilson's formula, everything else by the bootstrap."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fit.result import Z95

FloatArray = NDArray[np.float64]

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


def calibration_error(confidence: Sequence[float], right: Sequence[bool], bins: int = 15) -> Figure:
    """Return the expected calibration error in bins of equal width (Guo et al., ICML 2017) with its interval."""

    def error(sets: FloatArray) -> FloatArray:
        claimed, hit = sets[:, :, 0], sets[:, :, 1]
        of_bin = np.minimum((claimed * bins).astype(np.int64), bins - 1)
        off = [np.where(of_bin == b, hit - claimed, 0.0).sum(axis=1) for b in range(bins)]
        return np.asarray(np.abs(off).sum(axis=0) / sets.shape[1])

    return bootstrapped(error, np.column_stack([confidence, right]).astype(np.float64))


def _column(values: Sequence[float]) -> FloatArray:
    return np.array(values, dtype=np.float64)[:, None]
