"""What is left that no smooth misfit explains: a few readings that stand aside, or beads that shake together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.noise import robust_deviation

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# A remainder must exceed the scatter of chi-squared by so much: right causes leave up to 5, by outliers and by noise
# that is not quite what was stated.
_ROUGH_SIGMA = 8.0
# And without any cause, so much beyond the noise that most of the residuals show.
_TAIL_SIGMA = 4.0
# The beads' mean in each row averages over outliers and understated noise alike: right causes leave up to 3. Two
# consecutive differences share a row, by which the sum of their squares scatters more by the root of 1.5.
_SHAKING_SIGMA = 4.5 * np.sqrt(1.5)
_FEWEST_BEADS = 4
_WRENCH = 6


def rough_remainder(residual: Sequence[FloatArray], floor: float) -> float:
    """Return half of what the whitened residuals' sum of squares has beyond noise, where that stands out; else 0.

    Parameters
    ----------
    residual : (r,) of each experiment
    floor : root mean square of noise alone
    """
    values = np.concatenate(list(residual))
    excess = _deviations_beyond(values, floor)
    return _half_of_excess(values, floor, excess) if excess > _ROUGH_SIGMA else 0.0


def rough_gap(residual: Sequence[FloatArray], floor: float) -> float:
    """Return the rough remainder of a baseline; 0 where its noise was merely understated: most residuals show that.

    Parameters
    ----------
    residual, floor : as in :func:`rough_remainder`
    """
    values = np.concatenate(list(residual))
    usual = max(floor, robust_deviation(values))
    return rough_remainder(residual, floor) if _deviations_beyond(values, usual) > _TAIL_SIGMA else 0.0


def shaking(residual: Sequence[FloatArray], seen: Sequence[BoolArray]) -> float:
    """Return half of what the beads' common motion from row to row has beyond noise, where that stands out; else 0.

    An error that they share throughout, such as that of their rest positions, is no shaking.

    Parameters
    ----------
    residual : (r,) of each experiment, whitened
    seen : (n, 6 + 3m) of each, which channels of which row they are
    """
    common, of_beads = [], []
    for r, where in zip(residual, seen, strict=True):
        channels = np.full(where.shape, np.nan)
        channels[where] = r
        beads = channels[:, _WRENCH:].reshape(len(where), -1, 3)
        count = np.isfinite(beads).sum(axis=1)
        sums = np.nansum(beads, axis=1) / np.sqrt(np.maximum(count, 1))
        common.append((np.diff(sums[(count >= _FEWEST_BEADS).all(axis=1)], axis=0) / np.sqrt(2.0)).ravel())
        of_beads.append(beads[np.isfinite(beads)])
    together, noise = np.concatenate(common), robust_deviation(np.concatenate(of_beads))
    excess = _deviations_beyond(together, noise)
    return _half_of_excess(together, noise, excess) if excess > _SHAKING_SIGMA else 0.0


def _deviations_beyond(values: FloatArray, noise: float) -> float:
    """Return by how many of its deviations the sum of squares is beyond that of white noise."""
    if not len(values):
        return 0.0
    return float((values @ values / noise**2 - len(values)) / np.sqrt(2.0 * len(values)))


def _half_of_excess(values: FloatArray, noise: float, excess: float) -> float:
    return excess * noise**2 * float(np.sqrt(len(values) / 2.0))
