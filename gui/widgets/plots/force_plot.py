"""Force and torque of the last seconds with the bands of their limits."""

from itertools import cycle

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QVBoxLayout, QWidget

from daq.limits import Limits
from gui.theme import theme_of
from gui.widgets.plots.live_rows import LiveRows
from robot_drivers.protocols import FloatArray

SPAN_S = 12.0
_ROWS_PER_S = 200
_BAND_ALPHA = 36
_LEAST_HEIGHT = 120


class ForcePlot(QWidget):
    """Draws the wrench with its zero taken off; the zero moves the whole history, for the samples are kept as read."""

    def __init__(self, limits: Limits, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._rows = LiveRows(round(SPAN_S * _ROWS_PER_S), 7)
        self._force = _Panel("force", "N", limits.force_n, slice(1, 4))
        self._torque = _Panel("torque", "N·m", limits.torque_nm, slice(4, 7))
        self._panels = (self._force, self._torque)
        self._turns = cycle(self._panels)
        self._torque.plot.setXLink(self._force.plot)
        self._force.plot.setXRange(-SPAN_S, 0.0, padding=0.0)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        self._legend = QLabel()
        self._legend.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        layout.addWidget(self._legend)
        layout.addWidget(self._force.plot)
        layout.addWidget(self._torque.plot)
        self._torque.plot.getPlotItem().setLabel("bottom", "time, s")
        self._dress()

    def set_limits(self, limits: Limits) -> None:
        """Take the limits of another rig."""
        self._force.set_limit(limits.force_n)
        self._torque.set_limit(limits.torque_nm)

    def show_rows(self, rows: FloatArray, zero: FloatArray | None) -> None:
        """Draw rows (n, 7) of host time in s and wrench less ``zero`` (6,), in the place of those before."""
        self._rows.clear()
        self._rows.add(rows)
        for panel in self._panels:
            self._draw(panel, zero)

    def add(self, rows: FloatArray, zero: FloatArray | None) -> None:
        """Add rows (n, 7) as they come, many times a second, and draw all of them less ``zero`` (6,).

        The panels take turns: painting both with every telemetry took a fifth of a core, and at half its rate nobody
        sees a difference.
        """
        self._rows.add(rows)
        if self.isVisible():
            self._draw(next(self._turns), zero)

    def clear(self) -> None:
        """Forget what was shown."""
        self._rows.clear()

    def changeEvent(self, event: QEvent) -> None:
        """Follow the theme."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._dress()

    def _draw(self, panel: "_Panel", zero: FloatArray | None) -> None:
        kept = self._rows.all()
        if len(kept):
            kept[:, 1:] -= 0.0 if zero is None else zero
            panel.draw(kept[:, 0] - kept[-1, 0], kept[:, panel.columns])

    def _dress(self) -> None:
        theme = theme_of(self)
        axes = [
            f'<span style="color:{colour}">━ {axis}</span>'
            for axis, colour in zip("xyz", theme.channels, strict=True)
        ]
        self._legend.setText("&nbsp;&nbsp;&nbsp;".join(axes))
        for panel in self._panels:
            panel.dress(self)


class _Panel:
    """Three curves, of some columns of the rows, and the bands outside of ± the limit."""

    def __init__(self, name: str, unit: str, limit: float, columns: slice) -> None:
        self.columns = columns
        self.plot = pg.PlotWidget()
        self.plot.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        self.plot.setMinimumHeight(_LEAST_HEIGHT)
        self._name, self._unit = name, unit
        item = self.plot.getPlotItem()
        item.setMenuEnabled(False)
        item.hideButtons()
        item.setMouseEnabled(x=False, y=False)
        item.showGrid(x=True, y=True, alpha=0.15)
        item.setLabel("left", name, units=None)
        self._curves = [item.plot() for _ in range(3)]
        for curve in self._curves:
            curve.setDownsampling(auto=True, method="peak")
            curve.setClipToView(True)
        self._bands = [
            pg.LinearRegionItem(orientation="horizontal", movable=False, pen=pg.mkPen(None)) for _ in range(2)
        ]
        for band in self._bands:
            item.addItem(band, ignoreBounds=True)
        self.set_limit(limit)

    def set_limit(self, limit: float) -> None:
        """Show the bands beyond a limit."""
        self._limit = limit
        self._bands[0].setRegion((limit, 100.0 * limit))
        self._bands[1].setRegion((-100.0 * limit, -limit))
        self.plot.setYRange(-1.15 * limit, 1.15 * limit, padding=0.0)

    def draw(self, time_s: FloatArray, values: FloatArray) -> None:
        """Draw values (n, 3); the scale widens when they leave it and shows the limit when they come near."""
        for curve, column in zip(self._curves, values.T, strict=True):
            curve.setData(time_s, column)
        largest = float(np.abs(values).max())
        reach = next((share for share in (0.1, 0.3, 1.15) if largest < 0.8 * share * self._limit), None)
        reach_of = 1.2 * largest if reach is None else reach * self._limit
        self.plot.setYRange(-reach_of, reach_of, padding=0.0)

    def dress(self, widget: QWidget) -> None:
        """Take the colours of the theme."""
        theme = theme_of(widget)
        self.plot.setBackground(theme.surface)
        item = self.plot.getPlotItem()
        for side in ("left", "bottom"):
            axis = item.getAxis(side)
            axis.enableAutoSIPrefix(False)
            axis.setPen(theme.line)
            axis.setTextPen(theme.muted)
        item.getAxis("left").setWidth(64)
        item.setLabel("left", f"{self._name}, {self._unit}", color=theme.muted)
        for curve, colour in zip(self._curves, theme.channels, strict=True):
            curve.setPen(pg.mkPen(colour, width=1))
        for band in self._bands:
            colour = pg.mkColor(theme.bad)
            colour.setAlpha(_BAND_ALPHA)
            band.setBrush(colour)
