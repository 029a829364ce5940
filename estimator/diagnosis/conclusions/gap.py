"""How far a gap shrinks, by channel and by experiment, how sure that is, and what of it is noise alone.

A misfit is no row's own: what a model misses lasts. So the uncertainty of a closure comes from drawing whole stretches
of the experiments again, with replacement (a block bootstrap; Künsch, Ann. Statist. 17, 1989, 1217–1241).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from estimator.diagnosis.fitting.case import Case
from estimator.diagnosis.result import Gap, Quantity
from estimator.diagnosis.settings import ConclusionSettings

FloatArray = NDArray[np.float64]

# Channels by the kind that a reader asks for.
KINDS: Mapping[str, slice] = {"force": slice(0, 3), "torque": slice(3, 6), "fiducials": slice(6, None)}
_UNITS: Mapping[str, str] = {"force": "N", "torque": "N·m", "fiducials": "m"}
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
    one, two = _by_kind(case, before), _by_kind(case, after)
    return {kind: gap_of(one[kind], two[kind], floor, case.settings.conclusions) for kind in KINDS}


def largest_gaps(case: Case, residual: Sequence[FloatArray], floor: float) -> dict[str, Quantity]:
    """Return how large a gap these data leave room for, root mean square, of force, torque and fiducials.

    A larger one would show with 95 %: the misfit's sum of squares less that of noise, as far as that scatters, and all
    that the errors which rows share may hide, what meshes leave among them. Kinds that were not measured are left out.

    Parameters
    ----------
    residual : (r,) of each experiment, whitened
    floor : root mean square of the noise alone
    """
    of_kinds = _by_kind(case, residual)
    hidden = _by_kind(case, [w.shared_variance for w in case.whitenings])
    deviations = _by_kind(case, [np.broadcast_to(w.deviation, w.seen.shape)[w.seen] for w in case.whitenings])
    found = {}
    for kind, unit in _UNITS.items():
        values = np.concatenate(of_kinds[kind]) / floor
        if not len(values):
            continue
        surely = ndtri(1.0 - case.settings.conclusions.false_alarms) * np.sqrt(2.0 / len(values))
        excess = max(float(np.mean(values**2)) - 1.0, 0.0) + float(surely)
        share = np.sqrt(excess + float(np.mean(np.concatenate(hidden[kind]))))
        deviation = float(np.sqrt(np.mean(np.concatenate(deviations[kind]) ** 2)))
        found[kind] = Quantity(float(share) * deviation, 0.0, unit)
    return found


def _by_kind(case: Case, values: Sequence[FloatArray]) -> dict[str, list[FloatArray]]:
    """Return values (r,) of each experiment's measurements, or of the last of them, by their kind of channel."""
    found: dict[str, list[FloatArray]] = {}
    for kind, chosen in KINDS.items():
        found[kind] = []
        for of_experiment, whitening in zip(values, case.whitenings, strict=True):
            channel = np.nonzero(whitening.seen)[1][-len(of_experiment) :]
            numbers = np.arange(whitening.seen.shape[1])[chosen]
            found[kind].append(of_experiment[np.isin(channel, numbers)])
    return found
