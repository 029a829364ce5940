"""Two parts of a page beside each other, and what becomes of them where the page is too narrow for both.

A page then grows downwards, and scrolls there, before it would scroll sideways.
"""

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QLayout, QSplitter, QVBoxLayout, QWidget

from gui.widgets.cards import scrolled

_GAP = 8
_SPACING = 12


def side_by_side(left: QWidget, right: QWidget, widths: tuple[int, int]) -> QSplitter:
    """Return both with these widths at first; the right one takes what room is left."""
    split = QSplitter(Qt.Orientation.Horizontal)
    split.addWidget(_padded(left, 0, _GAP))
    split.addWidget(_padded(right, _GAP, 0))
    split.setStretchFactor(1, 1)
    split.setSizes(list(widths))
    split.setChildrenCollapsible(False)
    split.setHandleWidth(1)
    return split


class BesideOrBelow(QWidget):
    """Two parts side by side where there is room for both, else the right one below the left one.

    Parameters
    ----------
    stretches : how the room is shared
    """

    def __init__(
        self, left: QWidget, right: QWidget, stretches: tuple[int, int], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._parts = (left, right)
        self._layout = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._layout.setSizeConstraint(QLayout.SizeConstraint.SetNoConstraint)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(_SPACING)
        for part, stretch in zip(self._parts, stretches, strict=True):
            self._layout.addWidget(part, stretch)

    def minimumSizeHint(self) -> QSize:
        """As wide as the wider part."""
        return QSize(max(self._least_widths()), self._layout.minimumSize().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Arrange the parts for another width."""
        super().resizeEvent(event)
        needed = sum(self._least_widths()) + _SPACING
        direction = QBoxLayout.Direction
        wanted = direction.LeftToRight if self.width() >= needed else direction.TopToBottom
        if self._layout.direction() != wanted:
            self._layout.setDirection(wanted)
            self.updateGeometry()

    def _least_widths(self) -> list[int]:
        return [_least_width(part) for part in self._parts]


class ScrolledSides(QSplitter):
    """Two parts that scroll up and down by themselves: side by side where there is room for both, else stacked.

    Parameters
    ----------
    stretches : how the room is shared at first; the handle shares it otherwise
    """

    def __init__(
        self, left: QWidget, right: QWidget, stretches: tuple[int, int], parent: QWidget | None = None
    ) -> None:
        super().__init__(Qt.Orientation.Horizontal, parent)
        self._parts = (left, right)
        self._areas = (scrolled(left), scrolled(right))
        for number, (area, stretch) in enumerate(zip(self._areas, stretches, strict=True)):
            self.addWidget(area)
            self.setStretchFactor(number, stretch)
        self.setChildrenCollapsible(False)

    def minimumSizeHint(self) -> QSize:
        """As wide as the wider part."""
        return QSize(max(self._least_widths()), super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Arrange the parts for another width."""
        super().resizeEvent(event)
        widths = self._least_widths()
        beside = self.width() >= sum(widths) + self.handleWidth()
        wanted = Qt.Orientation.Horizontal if beside else Qt.Orientation.Vertical
        if self.orientation() != wanted:
            self.setOrientation(wanted)
        for area, width in zip(self._areas, widths, strict=True):
            area.setMinimumWidth(width)

    def _least_widths(self) -> list[int]:
        """Return how wide each part must be so that it need not scroll sideways, px."""
        return [
            _least_width(part) + area.verticalScrollBar().sizeHint().width()
            for part, area in zip(self._parts, self._areas, strict=True)
        ]


def _least_width(widget: QWidget) -> int:
    return widget.minimumSizeHint().expandedTo(widget.minimumSize()).width()


def _padded(widget: QWidget, left: int, right: int) -> QWidget:
    made = QWidget()
    layout = QVBoxLayout(made)
    layout.setContentsMargins(left, 0, right, 0)
    layout.addWidget(widget)
    return made
