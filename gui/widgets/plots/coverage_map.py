"""How often the corners of the calibration board were seen in each part of an image."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from gui.theme import theme_of

_ENOUGH = 8  # corners in a cell that show as full colour


class CoverageMap(QWidget):
    """A cell is filled the more, the more corners were seen there; an empty one still needs a view."""

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._title = title
        self.show_counts(np.zeros((6, 8), dtype=np.int64))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)

    def show_counts(self, counts: NDArray[np.int64]) -> None:
        """Show the corners seen in each cell (rows, columns)."""
        self._counts = counts
        seen = float(np.mean(counts > 0))
        self.setAccessibleName(f"coverage of the {self._title} image {seen:.0%}")
        self.update()

    def clear(self) -> None:
        """Show that nothing was seen yet."""
        self.show_counts(np.zeros_like(self._counts))

    def sizeHint(self) -> QSize:
        """As an image of the cameras, with a line of text."""
        return QSize(240, 180 + self.fontMetrics().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        theme = theme_of(self)
        painter = QPainter(self)
        line = self.fontMetrics().height() + 4
        painter.setPen(QColor(theme.muted))
        told = f"{self._title}: {float(np.mean(self._counts > 0)):.0%} covered"
        painter.drawText(self.rect(), Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft, told)
        rows, columns = self._counts.shape
        side = min(self.width() / columns, (self.height() - line) / rows)
        painter.setPen(QColor(theme.line))
        for row in range(rows):
            for column in range(columns):
                colour = QColor(theme.accent)
                colour.setAlphaF(min(1.0, float(self._counts[row, column]) / _ENOUGH))
                painter.setBrush(colour)
                painter.drawRect(QRectF(column * side, line + row * side, side - 1.5, side - 1.5))
        painter.end()
