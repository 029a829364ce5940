"""Which rows are kept, and what is done in each: away from rest, still, or on the way back."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.importing.table import FloatArray

_STILL = 0.02  # of the usual step from row to row
_AT_REST = 2e-3  # of the range of the motion


def kept_rows(distance: FloatArray, first: int, last: int, most: int) -> NDArray[np.intp]:
    """Return at most so many rows from ``first`` to ``last`` (from 0): evenly in time, the farthest among them.

    Parameters
    ----------
    distance : (n,) of the gripper from where it starts
    """
    rows = np.arange(first, last + 1)
    if len(rows) <= most:
        return rows
    chosen = set(np.round(np.linspace(first, last, most)).astype(int).tolist())
    farthest = first + int(np.nanargmax(distance[first : last + 1]))
    return np.array(sorted(chosen | {farthest}), dtype=np.intp)


def phases_of(distance: FloatArray) -> tuple[str, ...]:
    """Return the phase of each row from how far the gripper is from rest, (n,)."""
    step = np.diff(distance, prepend=distance[:1])
    usual = float(np.median(np.abs(step[step != 0]))) if np.any(step != 0) else 0.0
    phases, back = [], False
    for change in step:
        if abs(change) <= _STILL * usual:
            phases.append("return_hold" if back else "hold")
        else:
            back = change < 0
            phases.append("return" if back else "ramp")
    return tuple(phases)


def steps_of(distance: FloatArray) -> NDArray[np.int64]:
    """Return the number of the step of each row: one more whenever the gripper has moved, 0 at rest."""
    step = np.abs(np.diff(distance, prepend=distance[:1]))
    usual = float(np.median(step[step != 0])) if np.any(step != 0) else 0.0
    return np.asarray(np.cumsum(step > _STILL * usual), dtype=np.int64)


def rows_at_rest(motion: Sequence[FloatArray]) -> int:
    """Return how many of the first rows show no motion, at least one.

    Parameters
    ----------
    motion : coordinates or distances (n,) of the gripper
    """
    rows = min(len(values) for values in motion)
    away = np.zeros(rows)
    for values in motion:
        known = values[np.isfinite(values)]
        away = np.maximum(away, np.abs(values[:rows] - (known[0] if len(known) else 0.0)))
    moved = np.asarray(~(away <= _AT_REST * np.nanmax(away)))
    return max(int(np.argmax(moved)), 1) if moved.any() else rows
