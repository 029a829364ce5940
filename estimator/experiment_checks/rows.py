"""Rows of the table: order in time, rows that stand there twice, and streams that stood still."""

import numpy as np

from estimator.experiment.model import Experiment
from estimator.experiment.observations import line_of_row
from estimator.experiment_checks.finding import Finding, of_rows

_FEWEST_CHANNELS = 3


def check_order(experiment: Experiment) -> list[Finding]:
    """Time ascends from row to row: a body's state follows from what was done to it before."""
    step = np.diff(experiment.time)
    findings = []
    back = np.flatnonzero(step < 0) + 1
    if len(back):
        findings.append(
            of_rows(
                "wrong",
                "order of rows",
                f"time runs back by {-step[back[0] - 1]:g} s, {_times(len(back))}",
                "sort the rows by time, and see why they were not",
                row=int(back[0]),
                column="time",
            )
        )
    same = np.flatnonzero(step == 0) + 1
    if len(same):
        findings.append(
            of_rows(
                "wrong",
                "order of rows",
                f"the same time as in the row before, {_times(len(same))}",
                "keep one row for each instant",
                row=int(same[0]),
                column="time",
            )
        )
    return findings


def check_repeated_rows(experiment: Experiment) -> list[Finding]:
    """No two rows are the same to the last digit: each has its own noise, unless it was simulated without.

    Only rows with at least three measured values that are not zero are compared; coarse digits repeat now and then.
    """
    rows = len(experiment.time)
    measured = np.column_stack([experiment.wrench, experiment.fiducials.reshape(rows, -1)])
    first: dict[bytes, int] = {}
    doubles: list[tuple[int, int]] = []
    for row, values in enumerate(measured):
        if np.count_nonzero(np.isfinite(values) & (values != 0)) < _FEWEST_CHANNELS:
            continue
        key = np.nan_to_num(values, nan=1e300).tobytes()
        if key in first:
            doubles.append((first[key], row))
        first.setdefault(key, row)
    if not doubles:
        return []
    earlier, row = doubles[0]
    return [
        of_rows(
            "suspicious",
            "repeated rows",
            f"every measured value is that of line {line_of_row(earlier)} to the last digit, {_times(len(doubles))}",
            "remove the copies; if the stream stood still, leave its fields empty",
            row=row,
        )
    ]


def _times(count: int) -> str:
    return "once" if count == 1 else f"in {count} rows"
