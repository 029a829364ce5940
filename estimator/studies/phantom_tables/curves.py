"""The paper's Table VIII: force against time and paths of the fiducials, measured and predicted, a panel a case."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from estimator.report.theme import ANCHOR, MEASURED, MUTED, PREDICTED, TRUTH
from estimator.studies.phantom_tables.layout import Found
from estimator.studies.phantom_tables.recorded import RecordedRetraction
from estimator.studies.running.case import Row

_COLUMNS = 3
_COLUMN_IN, _ROW_IN, _HEAD_IN = 4.2, 3.9, 0.6
_AXES = (("x", MEASURED), ("y", TRUTH), ("z", ANCHOR))


def curves_size(found: Found) -> tuple[float, float]:
    """Return width and height, inches."""
    return _COLUMNS * _COLUMN_IN, math.ceil(len(found) / _COLUMNS) * _ROW_IN + _HEAD_IN


def draw_curves(sheet: Figure, found: Found) -> None:
    """Draw forces above (measured solid, predicted dashed) and paths in the plane below (measured dark)."""
    rows = math.ceil(len(found) / _COLUMNS)
    panels = sheet.subplots(2 * rows, _COLUMNS, squeeze=False)
    height = rows * _ROW_IN + _HEAD_IN
    sheet.subplots_adjust(
        left=0.06, right=0.985, top=1 - _HEAD_IN / height, bottom=0.5 / height, wspace=0.22, hspace=0.42
    )
    for axes in panels.flat[:]:
        axes.set_visible(False)
    for number, (case, row) in enumerate(found):
        upper, lower = (panels[2 * (number // _COLUMNS) + part, number % _COLUMNS] for part in (0, 1))
        upper.set_visible(True)
        lower.set_visible(True)
        _draw_case(upper, lower, case, row)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    sheet.legend(handles, labels, loc="upper right", ncols=len(labels), fontsize=8)


def _draw_case(upper: Axes, lower: Axes, case: RecordedRetraction, row: Row) -> None:
    one = case.experiment
    force, fiducials = case.predicted(row)
    for axis, (name, colour) in enumerate(_AXES):
        upper.plot(
            one.time, one.wrench[:, axis], color=colour, linewidth=1.2, label=f"force {name}, measured"
        )
        upper.plot(one.time, force[:, axis], "--", color=colour, linewidth=1.2, label=f"{name}, predicted")
    upper.set_title(f"{case.motion}, {one.phantom_id}, {case.anchoring}", fontsize=9)
    upper.set_xlabel("time, s", fontsize=8)
    upper.set_ylabel("N", fontsize=8)
    order = np.argsort(one.time)
    for bead in range(one.fiducials.shape[1]):
        lower.plot(*(1e3 * one.fiducials[order, bead, :2].T), color=MUTED, linewidth=2.0)
        lower.plot(*(1e3 * fiducials[order, bead, :2].T), color=PREDICTED, linewidth=1.0)
    lower.set_aspect("equal", adjustable="datalim")
    lower.set_xlabel("x, mm", fontsize=8)
    lower.set_ylabel("y, mm", fontsize=8)
