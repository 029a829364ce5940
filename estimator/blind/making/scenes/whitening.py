"""Differences of readings in units of a case's noise, that of the gripper's reported pose among it.

A reported pose is off by a few tens of micrometres, and with it the tissue that is gripped there: forces and beads of
all rows at that pose are off together. With these directions as U η, η ~ N(0, 1), and the white noise of force and
beads scaled to one, the covariance is I + U Uᵀ, whose inverse root is I − Q (1 − (1 + s²)^−½) Qᵀ with the left singular
vectors Q and singular values s of U. Noise that lasts from row to row, a part ρ of it, hides what changes slowly: the
rows x_t become (x_t − ρ x_{t−1}) / (1 − ρ²)^½ first. The diagnosis whitens for itself, by more: what tests it shares
none of its code.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.scenes.retraction import Rows
from estimator.experiment import SensorNoise

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Whitening:
    """The inverse root of one experiment's covariance: vectors (r, k), singular (k,), deviation (c,), correlation ρ."""

    vectors: FloatArray
    singular: FloatArray
    deviation: FloatArray
    correlation: float

    def apply(self, channels: FloatArray) -> FloatArray:
        """Whiten a difference of channels (n, c) to (n c,)."""
        scaled = _uncorrelated(channels / self.deviation, self.correlation).reshape(-1)
        kept = 1.0 / np.sqrt(1.0 + self.singular**2)
        return np.asarray(scaled - self.vectors @ ((1.0 - kept) * (self.vectors.T @ scaled)))


def whitening_of(
    rows: Rows, by_position: FloatArray, sensor: SensorNoise, correlation: float = 0.0
) -> Whitening:
    """Build the whitening of an experiment.

    Parameters
    ----------
    rows : of its motion
    sensor : standard deviations of a row's force (N), torque (N m), beads and pose (m)
    by_position : (n, c, 3), by how much channels (wrench, then beads) change with the gripper's position, per m
    correlation : of the noise of a row's wrench and beads with that of the row before
    """
    beads = (by_position.shape[1] - 6) // 3
    deviation = np.repeat([sensor.force_std, sensor.torque_std, sensor.fiducial_std], [3, 3, 3 * beads])
    pose = pose_of_row(rows)
    # The mean of a pose's rows is known better than one of them.
    known = sensor.position_std / np.sqrt(np.bincount(pose))
    directions = np.zeros((*by_position.shape[:2], len(known), 3))
    directions[np.arange(len(pose)), :, pose] = by_position * known[pose][:, None, None]
    directions = _uncorrelated(directions / deviation[:, None, None], correlation)
    vectors, singular, _ = np.linalg.svd(directions.reshape(-1, 3 * len(known)), full_matrices=False)
    return Whitening(vectors, singular, deviation, correlation)


def _uncorrelated(rows: FloatArray, correlation: float) -> FloatArray:
    """Return rows (n, ...) less what the row before tells of each, at the variance that they had."""
    told = correlation * np.concatenate([np.zeros_like(rows[:1]), rows[:-1]])
    rest = np.full(len(rows), np.sqrt(1.0 - correlation**2))
    rest[0] = 1.0
    return np.asarray((rows - told) / rest.reshape(-1, *[1] * (rows.ndim - 1)))


def pose_of_row(rows: Rows) -> NDArray[np.int64]:
    """Number the stays of the gripper at one pose; return that of each row (n,)."""
    pose = np.column_stack([rows.position, rows.rotation.as_rotvec()])
    moved = np.abs(np.diff(pose, axis=0)).max(axis=1) > 1e-9
    return np.concatenate([[0], np.cumsum(moved)])


def length(whitenings: Sequence[Whitening], differences: Sequence[FloatArray], imitable: FloatArray) -> float:
    """Return the length of whitened differences, for each experiment (n, c), less what spans ``imitable`` (r, k)."""
    whole = whitened(whitenings, differences)
    return float(np.linalg.norm(whole - imitable @ (imitable.T @ whole)))


def whitened(whitenings: Sequence[Whitening], differences: Sequence[FloatArray]) -> FloatArray:
    """Return the differences of all experiments, whitened, as one vector (r,)."""
    return np.concatenate([w.apply(d) for w, d in zip(whitenings, differences, strict=True)])
