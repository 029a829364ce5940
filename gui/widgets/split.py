"""Two parts of a page beside each other, with a handle between them."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSplitter, QVBoxLayout, QWidget

_GAP = 8


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


def _padded(widget: QWidget, left: int, right: int) -> QWidget:
    made = QWidget()
    layout = QVBoxLayout(made)
    layout.setContentsMargins(left, 0, right, 0)
    layout.addWidget(widget)
    return made
