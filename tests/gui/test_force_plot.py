"""The plot of the last seconds of force and torque."""

import numpy as np
import pyqtgraph as pg
from pytestqt.qtbot import QtBot

from daq.virtual_rig.layout import LIMITS
from gui.widgets.plots.force_plot import ForcePlot

ZERO = np.array([1.0, 0.0, 0.0, 0.01, 0.0, 0.0])


def rows(count: int) -> np.ndarray:
    """Rows at 200 Hz whose force and torque along x rise by one and by a hundredth a second."""
    time_s = np.arange(count) / 200.0
    wrench = np.zeros((count, 6))
    wrench[:, 0], wrench[:, 3] = time_s, time_s / 100.0
    return np.column_stack([time_s, wrench])


def last_drawn(plot: ForcePlot) -> list[float]:
    """What force and torque panel show last along x; NaN for nothing."""
    panels = sorted(plot.findChildren(pg.PlotWidget), key=lambda panel: panel.y())
    curves = [panel.getPlotItem().listDataItems()[0].getOriginalDataset()[1] for panel in panels]
    return [float("nan") if curve is None else float(curve[-1]) for curve in curves]


def test_what_is_replayed_is_drawn_whole_and_less_its_zero(qtbot: QtBot) -> None:
    plot = ForcePlot(LIMITS)
    qtbot.addWidget(plot)
    plot.show_rows(rows(401), ZERO)
    assert last_drawn(plot) == [1.0, 0.01]
    plot.show_rows(rows(201), None)
    assert last_drawn(plot) == [1.0, 0.01]


def test_live_panels_take_turns_and_none_stays_behind(qtbot: QtBot) -> None:
    plot = ForcePlot(LIMITS)
    qtbot.addWidget(plot)
    plot.show()
    everything = rows(801)
    for begin in range(0, 800, 200):
        plot.add(everything[begin : begin + 200], None)
    newest, one_before = everything[799], everything[599]
    assert last_drawn(plot) == [one_before[1], newest[4]]


def test_nothing_is_painted_behind_another_page(qtbot: QtBot) -> None:
    plot = ForcePlot(LIMITS)
    qtbot.addWidget(plot)
    plot.add(rows(10), None)
    assert np.isnan(last_drawn(plot)).all()
