"""The tissue's pull on the gripper, which effects of the grip answer to: released of the noise of its measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# A channel of fewer rows than this, for each of the cosines that may smooth it, is taken as it is predicted.
_ROWS_PER_WAVE = 2


@dataclass(frozen=True, eq=False)
class GripLoad:
    """What pulls at the gripper in one experiment of n rows.

    Attributes
    ----------
    felt : (n, 6) wrench of the tissue on the gripper that acts, N and N·m; a constant in it is without effect
    unit_wrench : (n, 6) wrench of the baseline per unit of Young's modulus
    """

    felt: FloatArray
    unit_wrench: FloatArray

    @classmethod
    def none(cls, rows: int) -> GripLoad:
        """Return the load of so many rows without any."""
        return cls(np.zeros((rows, 6)), np.zeros((rows, 6)))


def without_noise(measured: FloatArray, predicted: FloatArray, most_waves: int) -> FloatArray:
    """Return a measured wrench (n, 6), NaN where not measured, without its noise.

    A gripper that yields to the noise of the measurement is predicted to feel a part of it once more: the misfit grows
    by the product of stiffness and compliance, and a compliance that is there looks less probable than it is. What
    is measured is therefore the prediction, scaled, and as many cosines over the rows as the Bayesian information
    criterion takes for more than noise (G. Schwarz, Ann. Statist. 6 (1978) 461).

    Parameters
    ----------
    predicted : (n, 6) by a hypothesis fitted to the measurements
    most_waves : cosines at the most
    """
    phase = (np.arange(len(measured)) + 0.5) / len(measured)
    waves = np.cos(np.pi * np.outer(phase, np.arange(most_waves + 1)))
    smooth = [_smooth(m, p, waves) for m, p in zip(measured.T, predicted.T, strict=True)]
    return np.column_stack(smooth)


def _smooth(measured: FloatArray, predicted: FloatArray, waves: FloatArray) -> FloatArray:
    """Return one channel (n,) without its noise; ``waves`` are (n, k)."""
    seen = np.isfinite(measured)
    rows = np.count_nonzero(seen)
    if rows < _ROWS_PER_WAVE * (waves.shape[1] - 1):
        return predicted
    best, lowest = predicted, np.inf
    for count in range(1, waves.shape[1] + 1):
        basis = np.column_stack([predicted, waves[:, :count]])
        found, *_ = np.linalg.lstsq(basis[seen], measured[seen])
        smooth = basis @ found
        left = float(np.sum((measured - smooth)[seen] ** 2))
        criterion = rows * np.log(max(left, np.finfo(np.float64).tiny)) + count * np.log(rows)
        if criterion < lowest:
            best, lowest = smooth, criterion
    return best
