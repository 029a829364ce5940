"""A sheet of small plots in the window's theme, for curves that are looked at and not live."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget

from gui.inks import Ink, colour
from gui.theme import theme_of

FloatArray = NDArray[np.float64]

_HEAD_SHARE = 0.3
_LEAST_HEIGHT = 130  # of a plot with its title, at which its ticks stay apart


@dataclass(frozen=True, slots=True)
class Stroke:
    """How a curve looks: its colour, its width (0 for dots alone), and whether it is dashed."""

    ink: Ink
    width: float = 0.0
    dashed: bool = False


class PlotSheet(pg.GraphicsLayoutWidget):  # type: ignore[misc]  # pyqtgraph has no types
    """A grid of plots; turn the wheel to zoom, drag to shift, and let the menu of a plot show all again."""

    def __init__(self, parent: QWidget | None = None) -> None:
        # the theme may reach the widget while it is being made
        self.plots: list[Any] = []
        super().__init__(parent)
        self.setBackground(None)
        self.ci.layout.setContentsMargins(2, 2, 2, 2)

    def add(self, row: int, column: int, title: str, left: str = "", bottom: str = "") -> Any:
        """Add a plot with a title and the labels of its axes, units included; return the plot."""
        plot = self.addPlot(row, column)
        plot.setTitle(title, size="9.5pt")
        plot.setLabel("left", left or None)
        plot.setLabel("bottom", bottom or None)
        plot.getAxis("left").enableAutoSIPrefix(False)
        plot.getAxis("bottom").enableAutoSIPrefix(False)
        plot.getAxis("left").setWidth(66 if left else 44)
        plot.showGrid(x=True, y=True, alpha=0.12)
        plot.hideButtons()
        self.setMinimumHeight(max(self.minimumHeight(), (row + 1) * _LEAST_HEIGHT))
        self.plots.append(plot)
        self._dress(plot)
        return plot

    def line(self, plot: Any, x: FloatArray, y: FloatArray, stroke: Stroke) -> None:
        """Draw a line through points; a NaN interrupts it."""
        style = Qt.PenStyle.DashLine if stroke.dashed else Qt.PenStyle.SolidLine
        pen = pg.mkPen(self.ink(stroke.ink), width=stroke.width, style=style)
        plot.addItem(pg.PlotDataItem(x, y, pen=pen, connect="finite", antialias=True))

    def dots(self, plot: Any, x: FloatArray, y: FloatArray, ink: Ink, size: float = 4.0) -> None:
        """Draw dots; one with a NaN is left out."""
        seen = np.isfinite(x) & np.isfinite(y)
        brush = pg.mkBrush(self.ink(ink))
        plot.addItem(pg.ScatterPlotItem(x[seen], y[seen], size=size, pen=None, brush=brush, antialias=True))

    def arrows(self, plot: Any, starts: FloatArray, ways: FloatArray, stroke: Stroke) -> None:
        """Draw arrows from places (m, 2) along ways (m, 2), in the units of the axes; those with a NaN are left out."""
        seen = np.isfinite(starts).all(axis=1) & np.isfinite(ways).all(axis=1)
        start, way = starts[seen], ways[seen]
        tip, across = start + way, way[:, ::-1] * [-1.0, 1.0]
        ends = [tip - _HEAD_SHARE * (way + sign * 0.5 * across) for sign in (-1.0, 1.0)]
        parts = np.stack([start, tip, tip, ends[0], tip, ends[1]], axis=1).reshape(-1, 2)
        pen = pg.mkPen(self.ink(stroke.ink), width=stroke.width)
        plot.addItem(pg.PlotDataItem(parts, pen=pen, connect="pairs", antialias=True))

    def pieces(self, plot: Any, pieces: FloatArray, stroke: Stroke) -> None:
        """Draw straight pieces (k, 2, 2), in the units of the axes."""
        pen = pg.mkPen(self.ink(stroke.ink), width=stroke.width)
        plot.addItem(pg.PlotDataItem(pieces.reshape(-1, 2), pen=pen, connect="pairs", antialias=True))

    def outline(self, plot: Any, corners: FloatArray, ink: Ink, opacity: float = 0.0) -> None:
        """Draw a closed polygon (k, 2), filled so far."""
        fill = self.ink(ink)
        fill.setAlphaF(opacity)
        closed = np.vstack([corners, corners[:1]])
        pen = pg.mkPen(self.ink(ink), width=1.4)
        level = float(corners[:, 1].min())
        plot.addItem(pg.PlotDataItem(closed, pen=pen, brush=fill, fillLevel=level, fillBrush=fill))

    def band(self, plot: Any, low: float, high: float, ink: Ink) -> None:
        """Shade what lies between two levels."""
        fill = self.ink(ink)
        fill.setAlphaF(0.18)
        region = pg.LinearRegionItem((low, high), "horizontal", brush=fill, pen=pg.mkPen(None), movable=False)
        plot.addItem(region, ignoreBounds=True)

    def ink(self, ink: Ink) -> QColor:
        """Return a colour of the reports on the present background."""
        return colour(ink, theme_of(self))

    def empty(self) -> None:
        """Take all curves away, and keep the axes."""
        for plot in self.plots:
            plot.clear()

    def changeEvent(self, event: QEvent) -> None:
        """Follow the theme; curves have their new colours when they are drawn again."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            for plot in self.plots:
                self._dress(plot)

    def _dress(self, plot: Any) -> None:
        theme = theme_of(self)
        for name in ("left", "bottom"):
            plot.getAxis(name).setPen(theme.line)
            plot.getAxis(name).setTextPen(theme.muted)
        plot.titleLabel.setText(plot.titleLabel.text, color=theme.text)
