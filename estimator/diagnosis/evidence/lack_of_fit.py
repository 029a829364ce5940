"""What is left that no smooth misfit explains, and no row by itself: a few readings aside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.noise.estimation import robust_deviation
from estimator.diagnosis.settings import EvidenceSettings

FloatArray = NDArray[np.float64]


def rough_remainder(residual: Sequence[FloatArray], floor: float, settings: EvidenceSettings) -> float:
    """Return half of what the whitened residuals' sum of squares has beyond noise, where that stands out; else 0.

    Parameters
    ----------
    residual : (r,) of each experiment
    floor : root mean square of noise alone
    """
    values = np.concatenate(list(residual))
    excess = _deviations_beyond(values, floor)
    return excess * floor**2 * float(np.sqrt(len(values) / 2.0)) if excess > settings.rough else 0.0


def rough_gap(residual: Sequence[FloatArray], floor: float, settings: EvidenceSettings) -> float:
    """Return the rough remainder of a baseline; 0 where its noise was merely understated: most residuals show that.

    Parameters
    ----------
    residual, floor : as in :func:`rough_remainder`
    """
    values = np.concatenate(list(residual))
    usual = max(floor, robust_deviation(values))
    stands_out = _deviations_beyond(values, usual) > settings.rough_tail
    return rough_remainder(residual, floor, settings) if stands_out else 0.0


def _deviations_beyond(values: FloatArray, noise: float) -> float:
    """Return by how many of its deviations the sum of squares is beyond that of white noise."""
    return float((values @ values / noise**2 - len(values)) / np.sqrt(2.0 * len(values)))
