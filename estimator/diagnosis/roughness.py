"""What is left that no smooth misfit explains: a few readings aside, beads that shake together or fall behind."""

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
# The beads' mean in each row averages over outliers and understated noise alike: right causes leave up to 2.5.
_SHAKING_SIGMA = 4.0
# Of that mean everything slower than so many rows is taken out: what a model misses is slow.
_SLOWEST_ROWS = 8
_FEWEST_BEADS = 4
# Beads that move by less than this share of what they move by at the fastest tell little of when they were seen. With
# nothing amiss, 16 cases of another simulator leave up to 2.1 deviations along the beads' paths.
_MOVING = 0.3
_WRENCH = 6


def rough_remainder(residual: Sequence[FloatArray], floor: float) -> float:
    """Return half of what the whitened residuals' sum of squares has beyond noise, where that stands out; else 0.

    Parameters
    ----------
    residual : (r,) of each experiment
    floor : root mean square of noise alone
    """
    values = np.concatenate(list(residual))
    excess = _deviations_beyond(values, len(values), floor)
    return _half_of_excess(len(values), floor, excess) if excess > _ROUGH_SIGMA else 0.0


def rough_gap(residual: Sequence[FloatArray], floor: float) -> float:
    """Return the rough remainder of a baseline; 0 where its noise was merely understated: most residuals show that.

    Parameters
    ----------
    residual, floor : as in :func:`rough_remainder`
    """
    values = np.concatenate(list(residual))
    usual = max(floor, robust_deviation(values))
    return (
        rough_remainder(residual, floor)
        if _deviations_beyond(values, len(values), usual) > _TAIL_SIGMA
        else 0.0
    )


def shaking(residual: Sequence[FloatArray], seen: Sequence[BoolArray]) -> float:
    """Return half of what the beads' quick common motion has beyond noise, where that stands out; else 0.

    An error that they share throughout, such as that of their rest positions, is no shaking.

    Parameters
    ----------
    residual : (r,) of each experiment, whitened
    seen : (n, 6 + 3m) of each, which channels of which row they are
    """
    common, of_beads, freedom = [], [], 0
    for r, where in zip(residual, seen, strict=True):
        beads = _of_beads(r, where).reshape(len(where), -1, 3)
        count = np.isfinite(beads).sum(axis=1)
        sums = np.nansum(beads, axis=1) / np.sqrt(np.maximum(count, 1))
        quick, free = _without_what_is_slow(sums[(count >= _FEWEST_BEADS).all(axis=1)])
        common.append(quick.ravel())
        freedom += 3 * free
        of_beads.append(beads[np.isfinite(beads)])
    return _beyond_noise(common, freedom, of_beads)


def out_of_step(
    residual: Sequence[FloatArray], seen: Sequence[BoolArray], predicted: Sequence[FloatArray]
) -> float:
    """Return half of what single rows are ahead of or behind the others beyond noise, where that stands out; else 0.

    An image that was late or was shown again has all beads aside along their paths, by as much as each moves.

    Parameters
    ----------
    residual, seen : as in :func:`shaking`
    predicted : (n, 6 + 3m) of each experiment, in units of the noise
    """
    aside, of_beads, freedom = [], [], 0
    for r, where, course in zip(residual, seen, predicted, strict=True):
        beads = _of_beads(r, where)
        known = np.isfinite(beads)
        velocity = np.where(known, np.gradient(course[:, _WRENCH:], axis=0), 0.0)
        speed = np.linalg.norm(velocity, axis=1)
        moving = speed > _MOVING * speed.max()
        along = (velocity * np.where(known, beads, 0.0)).sum(axis=1)[moving] / speed[moving]
        quick, free = _without_what_is_slow(along[:, None])
        aside.append(quick[:, 0])
        freedom += free
        of_beads.append(beads[known])
    return _beyond_noise(aside, freedom, of_beads)


def _of_beads(residual: FloatArray, seen: BoolArray) -> FloatArray:
    """Return the beads' part (n, 3m) of a residual (r,), NaN where nothing was seen."""
    channels = np.full(seen.shape, np.nan)
    channels[seen] = residual
    return channels[:, _WRENCH:]


def _beyond_noise(values: Sequence[FloatArray], freedom: int, of_beads: Sequence[FloatArray]) -> float:
    noise = robust_deviation(np.concatenate(list(of_beads)))
    excess = _deviations_beyond(np.concatenate(list(values)), freedom, noise)
    return _half_of_excess(freedom, noise, excess) if excess > _SHAKING_SIGMA else 0.0


def _without_what_is_slow(values: FloatArray) -> tuple[FloatArray, int]:
    """Return what is quick in columns (n, k), and how free each column is then."""
    slow = _slow(len(values))
    return values - slow @ (slow.T @ values), slow.shape[0] - slow.shape[1]


def _slow(rows: int) -> FloatArray:
    """Return the cosines (n, k) over rows that are slower than what counts as shaking, orthonormal."""
    order = np.arange(2 * rows // _SLOWEST_ROWS)
    waves = np.cos(np.pi * np.outer(np.arange(rows) + 0.5, order) / max(rows, 1))
    return np.asarray(waves / np.maximum(np.linalg.norm(waves, axis=0), 1e-300))


def _deviations_beyond(values: FloatArray, freedom: int, noise: float) -> float:
    """Return by how many of its deviations the sum of squares is beyond that of white noise so free."""
    if not freedom:
        return 0.0
    return float((values @ values / noise**2 - freedom) / np.sqrt(2.0 * freedom))


def _half_of_excess(freedom: int, noise: float, excess: float) -> float:
    return excess * noise**2 * float(np.sqrt(freedom / 2.0))
