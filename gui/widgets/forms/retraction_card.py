"""A standard retraction as a card with a drawing."""

import math

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QAbstractButton, QSizePolicy, QWidget

from daq.trajectories import Kind, Retraction
from gui.theme import Theme, theme_of

NAMES: dict[Kind, str] = {
    "pull": "Pull",
    "gradual_tangent_pull": "Gradual tangent pull",
    "twist_and_pull": "Twist and pull",
}

_BOLD = 1.15  # how much wider bold letters are


class RetractionCard(QAbstractButton):
    """A checkable card: a drawing of the phantom from its anchor to the gripper's way, the name, and the usual size."""

    def __init__(self, retraction: Retraction, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._retraction = retraction
        self.setCheckable(True)
        self.setText(NAMES[retraction.kind])
        self.setAccessibleName(f"retraction {NAMES[retraction.kind]}")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        """Drawing above two lines of text."""
        line = self.fontMetrics().height()
        longest = max(map(self.fontMetrics().horizontalAdvance, NAMES.values()))
        return QSize(round(_BOLD * longest) + 24, 72 + 2 * line + 22)

    def minimumSizeHint(self) -> QSize:
        """The same."""
        return self.sizeHint()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        theme = theme_of(self)
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        chosen = self.isChecked()
        painter.setBrush(QColor(theme.surface))
        painter.setPen(QPen(QColor(theme.accent if chosen else theme.line), 2.5 if chosen else 1.0))
        frame = QRectF(self.rect()).adjusted(1.5, 1.5, -1.5, -1.5)
        painter.drawRoundedRect(frame, 8, 8)
        if self.hasFocus():
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(theme.accent), 1.0, Qt.PenStyle.DotLine))
            painter.drawRoundedRect(frame.adjusted(4, 4, -4, -4), 5, 5)
        self._paint_drawing(painter, theme, QRectF(frame.left() + 14, 12, frame.width() - 28, 64))
        self._paint_text(painter, theme)
        painter.end()

    def _paint_drawing(self, painter: QPainter, theme: Theme, box: QRectF) -> None:
        middle = box.center().y()
        block = QRectF(box.left(), middle - 17, 0.5 * box.width(), 34)
        fill = QColor(theme.accent)
        fill.setAlpha(45)
        painter.setPen(QPen(QColor(theme.muted), 1.2))
        painter.setBrush(fill)
        painter.drawRect(block)
        painter.setPen(QPen(QColor(theme.text), 3.0))
        painter.drawLine(block.topLeft(), block.bottomLeft())
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.text))
        painter.drawRect(QRectF(block.right() - 9, middle - 8, 12, 16))
        start, end = QPointF(block.right() + 8, middle), QPointF(box.right() - 4, middle)
        pen = QPen(QColor(theme.accent), 2.4)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawLine(start, end)
        _arrow_head(painter, end, 0.0, theme.accent)
        if self._retraction.kind == "gradual_tangent_pull":
            _turn_in_plane(painter, QRectF(end.x() - 62, middle - 27, 54, 54), theme)
        elif self._retraction.kind == "twist_and_pull":
            _turn_about_way(painter, QPointF((start.x() + end.x()) / 2, middle), theme)

    def _paint_text(self, painter: QPainter, theme: Theme) -> None:
        r, line = self._retraction, self.fontMetrics().height()
        font = self.font()
        font.setBold(True)
        painter.setFont(font)
        painter.setPen(QColor(theme.text))
        box = QRectF(6, 82, self.width() - 12, line)
        painter.drawText(box, Qt.AlignmentFlag.AlignHCenter, self.text())
        painter.setFont(self.font())
        painter.setPen(QColor(theme.muted))
        turn = f", {math.degrees(r.angle):.0f}°" if r.angle else ""
        usual = f"{r.steps} × {1e3 * r.step_length:g} mm{turn}"
        painter.drawText(box.translated(0, line + 2), Qt.AlignmentFlag.AlignHCenter, usual)


def _turn_in_plane(painter: QPainter, box: QRectF, theme: Theme) -> None:
    """Draw a turn about the axis that points out of the drawing."""
    painter.setPen(QPen(QColor(theme.channels[1]), 2.2))
    painter.drawArc(box, -50 * 16, 100 * 16)
    tip = math.radians(50.0)
    centre, radius = box.center(), box.width() / 2
    end = QPointF(centre.x() + radius * math.cos(tip), centre.y() - radius * math.sin(tip))
    _arrow_head(painter, end, math.pi / 2 + tip, theme.channels[1])


def _turn_about_way(painter: QPainter, middle: QPointF, theme: Theme) -> None:
    """Draw a turn about the way itself."""
    path = QPainterPath()
    box = QRectF(middle.x() - 7, middle.y() - 20, 14, 40)
    path.arcMoveTo(box, 60)
    path.arcTo(box, 60, 285)
    painter.setPen(QPen(QColor(theme.channels[1]), 2.2))
    painter.drawPath(path)
    _arrow_head(painter, path.currentPosition(), math.radians(75.0), theme.channels[1])


def _arrow_head(painter: QPainter, tip: QPointF, direction: float, colour: str) -> None:
    """Draw the head of an arrow; the direction is in rad, counter-clockwise from the right."""
    turns = (direction + 0.42, direction - 0.42)
    corners = [tip - QPointF(9.0 * math.cos(turn), -9.0 * math.sin(turn)) for turn in turns]
    painter.save()
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(colour))
    painter.drawPolygon(QPolygonF([tip, *corners]))
    painter.restore()
