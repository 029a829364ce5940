"""How far a gap shrinks, by channel and by experiment, how sure that is, and what of it is noise alone.

A misfit is no row's own: what a model misses lasts. So the uncertainty of a closure comes from drawing whole stretches
of the experiments again, with replacement (a block bootstrap; Künsch, Ann. Statist. 17, 1989, 1217–1241).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.fitting.case import Case
from estimator.diagnosis.result import Gap
from estimator.diagnosis.settings import ConclusionSettings

FloatArray = NDArray[np.float64]

# Channels by the kind that a reader asks for.
KINDS: Mapping[str, slice] = {"force": slice(0, 3), "torque": slice(3, 6), "fiducials": slice(6, None)}
# Of normal values, so much lies on each side within one standard deviation.
_ONE_SIGMA = (15.87, 84.13)


def gap_of(
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    floor: float,
    settings: ConclusionSettings,
) -> Gap:
    """Return the gap over whitened residuals, one (r,) an experiment; NaN where nothing was measured.

    ``floor`` is the root mean square of the noise alone.
    """
    sums = np.array(
        [
            (one @ one, two @ two, len(one))
            for r, s in zip(before, after, strict=True)
            for one, two in zip(
                np.array_split(r, settings.stretches), np.array_split(s, settings.stretches), strict=True
            )
        ]
    )
    one, two = _root_mean_squares(sums.sum(axis=0))
    closure = (one - two) / (one - floor) if one - floor > settings.within_noise else np.nan
    drawn = np.random.default_rng(0).integers(len(sums), size=(settings.draws, len(sums)))
    some, others = _root_mean_squares(sums[drawn].sum(axis=1))
    closures = (some - others) / np.maximum(some - floor, settings.within_noise)
    low, high = np.percentile(closures, _ONE_SIGMA)
    std = float(high - low) / 2.0 if np.isfinite(closure) else float("nan")
    return Gap(float(one), float(two), floor, float(closure), std)


def _root_mean_squares(sums: FloatArray) -> FloatArray:
    """Return those (2, ...) of sums of squares before and after, and of how many values (..., 3); NaN of none."""
    count = np.where(sums[..., 2] > 0, sums[..., 2], np.nan)
    return np.array([np.sqrt(sums[..., 0] / count), np.sqrt(sums[..., 1] / count)])


def gaps_by_kind(
    case: Case, before: Sequence[FloatArray], after: Sequence[FloatArray], floor: float
) -> dict[str, Gap]:
    """Return the gaps of force, torque and fiducials."""
    found = {}
    for kind, chosen in KINDS.items():
        picked = []
        for residuals in (before, after):
            parts = []
            for r, whitening in zip(residuals, case.whitenings, strict=True):
                channel = np.nonzero(whitening.seen)[1][-len(r) :]
                numbers = np.arange(whitening.seen.shape[1])[chosen]
                parts.append(r[np.isin(channel, numbers)])
            picked.append(parts)
        found[kind] = gap_of(picked[0], picked[1], floor, case.settings.conclusions)
    return found
