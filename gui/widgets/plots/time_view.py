"""The planned motion over time, with the measuring windows."""

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QSizePolicy, QVBoxLayout, QWidget

from gui.recording.motion_profile import MotionProfile
from gui.theme import theme_of

_LEAST_HEIGHT = 140
_LEAST_TURN_DEG = 1e-3


class TimeView(QWidget):
    """Draws the distance from rest in mm and the turn in degrees, each with its own axis."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._plot = pg.PlotWidget()
        self._plot.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        self._plot.setMinimumHeight(_LEAST_HEIGHT)
        item = self._plot.getPlotItem()
        item.setMenuEnabled(False)
        item.hideButtons()
        item.setMouseEnabled(x=False, y=False)
        self._way = item.plot()
        self._turns = pg.ViewBox(enableMouse=False)
        item.showAxis("right")
        item.scene().addItem(self._turns)
        item.getAxis("right").linkToView(self._turns)
        self._turns.setXLink(item)
        self._turn = pg.PlotCurveItem()
        self._turns.addItem(self._turn)
        item.vb.sigResized.connect(lambda: self._turns.setGeometry(item.vb.sceneBoundingRect()))
        self._windows: list[pg.LinearRegionItem] = []
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._plot)
        self._dress()

    def show_profile(self, profile: MotionProfile | None) -> None:
        """Show a motion, or none."""
        for window in self._windows:
            self._plot.removeItem(window)
        self._windows = []
        if profile is None:
            self._way.setData([], [])
            self._turn.setData([], [])
            return
        self._way.setData(profile.time_s, 1e3 * np.linalg.norm(profile.position_m, axis=1))
        self._turn.setData(profile.time_s, profile.turn_deg)
        most_deg = float(profile.turn_deg.max())
        self._plot.getPlotItem().showAxis("right", show=most_deg > _LEAST_TURN_DEG)
        self._turn.setVisible(most_deg > _LEAST_TURN_DEG)
        self._turns.setYRange(0.0, max(1.0, 1.1 * most_deg), padding=0.0)
        self._plot.setXRange(0.0, profile.duration_s, padding=0.0)
        for begin, end in profile.windows_s.tolist():
            window = pg.LinearRegionItem((begin, end), movable=False, pen=pg.mkPen(None))
            window.setZValue(-10)
            self._plot.addItem(window, ignoreBounds=True)
            self._windows.append(window)
        self._dress()

    def changeEvent(self, event: QEvent) -> None:
        """Follow the theme."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._dress()

    def _dress(self) -> None:
        theme = theme_of(self)
        self._plot.setBackground(theme.surface)
        item = self._plot.getPlotItem()
        for side in ("left", "right", "bottom"):
            item.getAxis(side).enableAutoSIPrefix(False)
            item.getAxis(side).setPen(theme.line)
            item.getAxis(side).setTextPen(theme.muted)
        item.setLabel("left", "way, mm", color=theme.channels[0])
        # the plot's own setLabel would show an axis that is hidden
        item.getAxis("right").setLabel("turn, °", color=theme.channels[1])
        item.setLabel("bottom", "time, s (shaded: measured)", color=theme.muted)
        self._way.setPen(pg.mkPen(theme.channels[0], width=2))
        self._turn.setPen(pg.mkPen(theme.channels[1], width=1.6))
        for window in self._windows:
            colour = pg.mkColor(theme.good)
            colour.setAlpha(40)
            window.setBrush(colour)
