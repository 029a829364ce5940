"""A lamp that can be read without colours: each state has a shape of its own."""

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from gui.rig.state import Health
from gui.theme import theme_of

_WORDS = {"off": "off", "good": "good", "doubtful": "to be looked at", "bad": "bad"}


class Lamp(QWidget):
    """A ring while off, a disc when good, a triangle when doubtful, a square when bad."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._health: Health = "off"
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.show_health("off")

    @property
    def health(self) -> Health:
        """What it shows."""
        return self._health

    def show_health(self, health: Health) -> None:
        """Show a state."""
        self._health = health
        self.setAccessibleName(_WORDS[health])
        self.setToolTip(_WORDS[health])
        self.update()

    def sizeHint(self) -> QSize:
        """As tall as a line of text."""
        side = self.fontMetrics().height()
        return QSize(side, side)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        theme = theme_of(self)
        colours = {"off": theme.muted, "good": theme.good, "doubtful": theme.doubtful, "bad": theme.bad}
        colour = QColor(colours[self._health])
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(colour, 1.6))
        painter.setBrush(Qt.BrushStyle.NoBrush if self._health == "off" else colour)
        side = 0.62 * min(self.width(), self.height())
        box = QRectF((self.width() - side) / 2, (self.height() - side) / 2, side, side)
        match self._health:
            case "bad":
                painter.drawRect(box)
            case "doubtful":
                top = QPointF(box.center().x(), box.top())
                painter.drawPolygon([top, box.bottomRight(), box.bottomLeft()])
            case _:
                painter.drawEllipse(box)
        painter.end()
