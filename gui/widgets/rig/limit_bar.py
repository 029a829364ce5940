"""A magnitude against its limit."""

import math

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from gui.theme import theme_of

_DOUBTFUL, _BAD = 0.6, 0.85
"""Shares of the limit from which the bar changes its colour."""
_BAR_HEIGHT = 8


class LimitBar(QWidget):
    """A bar that is full at the limit, with name, value, limit and unit above it."""

    def __init__(self, name: str, unit: str, limit: float, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._name, self._unit, self._limit = name, unit, limit
        self._value = math.nan
        self._remark = ""
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    def set_limit(self, limit: float) -> None:
        """Take another limit."""
        self._limit = limit
        self.update()

    def show_value(self, value: float, remark: str = "") -> None:
        """Show a value, NaN for none, and what has to be known about it."""
        self._value, self._remark = value, remark
        self.setAccessibleName(self.text())
        self.setToolTip(f"{self.text()} {remark}".strip())
        self.update()

    def text(self) -> str:
        """What stands above the bar."""
        value = "–" if math.isnan(self._value) else f"{self._value:.{2 if self._limit < 10 else 1}f}"
        return f"{self._name} {value} / {self._limit:g} {self._unit}"

    def sizeHint(self) -> QSize:
        """Wide enough for the text."""
        metrics = self.fontMetrics()
        return QSize(metrics.horizontalAdvance(f"{self.text()}0000"), metrics.height() + _BAR_HEIGHT + 6)

    def minimumSizeHint(self) -> QSize:
        """The same."""
        return self.sizeHint()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        theme = theme_of(self)
        share = 0.0 if math.isnan(self._value) else max(0.0, min(self._value / self._limit, 1.0))
        colour = theme.good if share < _DOUBTFUL else theme.doubtful if share < _BAD else theme.bad
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(theme.text if not self._remark else theme.muted))
        painter.drawText(self.rect(), Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft, self.text())
        bar = QRectF(0, self.fontMetrics().height() + 3, self.width(), _BAR_HEIGHT)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.line))
        painter.drawRoundedRect(bar, 3, 3)
        if share > 0:
            painter.setBrush(QColor(theme.muted if self._remark else colour))
            painter.drawRoundedRect(QRectF(bar.left(), bar.top(), share * bar.width(), bar.height()), 3, 3)
        painter.end()
