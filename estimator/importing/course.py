"""Which rows are kept, and what is done in each: away from rest, still, or on the way back."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.importing.table import FloatArray

_STILL = 0.02  # of the usual step from row to row
_IN_STEPS = 12.0  # of the usual one, in noise the largest of thousands is six of them
_LEAST_JUMP = 0.05  # of the range of the component
_FEWEST_STEPS = 4
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


def zero_at_rest(wrench: FloatArray, rows: int, first: int, file: Path) -> FloatArray:
    """Return the mean of each component over the first rows, 0 where there is none, (6,).

    Parameters
    ----------
    wrench : (n, 6), NaN where a component was not measured
    rows : that are at rest
    first : number of the first row in its source
    file : mapping, as a message names it

    Raises
    ------
    InputError
        A force jumps among them, so that its zero is not that of the rows that follow.
    """
    zeroed_at = _jump_at_rest(wrench, rows)
    if zeroed_at is not None:
        begin = first + zeroed_at
        raise InputError(
            f"{file}: the force jumps at rest, in row {begin}, as where a sensor is zeroed; begin there, with "
            f'[rows] first = {begin}, or write [force] zero = "as it is"'
        )
    known = np.isfinite(wrench[:rows])
    total = np.where(known, wrench[:rows], 0.0).sum(axis=0)
    return np.asarray(total / np.maximum(known.sum(axis=0), 1))


def _jump_at_rest(wrench: FloatArray, rows: int) -> int | None:
    """Return the first row, from 0, behind the last jump of a component at rest; None where there is none."""
    found: list[int] = []
    for values in wrench.T:
        steps = np.abs(np.diff(values[:rows]))
        known = steps[np.isfinite(steps)]
        if len(known) < _FEWEST_STEPS:
            continue
        least = max(
            _IN_STEPS * float(np.median(known)), _LEAST_JUMP * float(np.ptp(values[np.isfinite(values)]))
        )
        found += (np.flatnonzero(np.nan_to_num(steps) > least) + 1).tolist()
    return max(found, default=None)
