"""Faults that begin at some instant: which rows they touch, and where the data put the beginning."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Constant, Readings, Values
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

ORDER = Constant("order", "1", (), 1.0, np.inf, fixed=True)
TIME = Constant("time", "s", (), 0.0, np.inf, fixed=True)


def bead_constant(name: str) -> Constant:
    """Return the number of a fiducial, from 0, as a constant."""
    return Constant(name, "1", (), 0.0, np.inf, fixed=True)


def bead(values: Values, name: str) -> int:
    """Return the number of a fiducial, from 0."""
    return round(values[name])


def number_of_beads(experiments: Sequence[Experiment]) -> int:
    """Return how many fiducials there are, of which one may be at fault."""
    return len(experiments[0].fiducials_rest)


def number_of_rows(experiments: Sequence[Experiment]) -> int:
    """Return how many rows there are in all, at each of which a fault may begin."""
    return sum(len(experiment.time) for experiment in experiments)


def after(experiment: Experiment, values: Values) -> BoolArray:
    """Tell for each row (n,) whether it is as late as the instant ``time`` of experiment number ``order``, or later."""
    if experiment.order == round(values["order"]):
        return experiment.time >= values["time"]
    return np.full(len(experiment.time), experiment.order > values["order"])


def seconds_of(experiment: Experiment, rows: BoolArray) -> list[float] | None:
    """Return when the last run of rows (n,) begins and ends, s; None where there is no such row."""
    return [float(one) for one in experiment.time[rows][[0, -1]]] if rows.any() else None


def in_order(readings: Sequence[Readings]) -> list[Readings]:
    """Return the readings in the order of their experiments in time."""
    return sorted(readings, key=lambda each: each.experiment.order)


def start_of_row(readings: Sequence[Readings], row: int) -> dict[str, float]:
    """Return order and time of the instant before a row, counted through all the experiments."""
    for each in readings:
        time = each.experiment.time
        if row < len(time):
            # Half way from the row before, so that no rounding decides whether a row belongs to it.
            start = 0.5 * (time[row] + time[row - 1]) if row else time[0]
            return {"order": float(each.experiment.order), "time": float(start)}
        row -= len(time)
    raise IndexError("the experiments have fewer rows")


def at_other_times(time: FloatArray, rows: FloatArray, seconds: float | FloatArray) -> FloatArray:
    """Return rows (n, k) of times (n,), s, as they were so many seconds () or (n,) later, straight between two of them.

    Before the first and after the last they stay as they are there.
    """
    found = np.empty_like(rows)
    for number, column in enumerate(rows.T):
        found[:, number] = np.interp(time + seconds, time, column)
    return found


def sums_to_the_end(rows: FloatArray) -> FloatArray:
    """Return the sum from each row (n, ...) to the last."""
    return np.cumsum(rows[::-1], axis=0)[::-1]
