"""Pieces of text and frames in the roles that the theme knows."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QLabel, QPushButton, QScrollArea, QVBoxLayout, QWidget


def label(text: str, role: str = "") -> QLabel:
    """Return a text that wraps; roles are "title", "heading", "muted", "figure", "good" and "bad"."""
    made = QLabel(text)
    made.setProperty("role", role)
    made.setWordWrap(role not in ("title", "figure"))
    made.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return made


def set_role(widget: QWidget, role: str) -> None:
    """Give a widget another role of the theme."""
    if widget.property("role") != role:
        widget.setProperty("role", role)
        widget.style().unpolish(widget)
        widget.style().polish(widget)


def button(text: str, role: str = "", tip: str = "") -> QPushButton:
    """Return a push button; roles are "primary", "stop" and "flat"."""
    made = QPushButton(text)
    made.setProperty("role", role)
    made.setToolTip(tip)
    made.setAutoDefault(False)
    return made


class Card(QFrame):
    """A framed part of a page; what belongs into it goes into ``body``."""

    def __init__(self, title: str = "", parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "card")
        self.body = QVBoxLayout(self)
        self.body.setContentsMargins(14, 12, 14, 12)
        self.body.setSpacing(8)
        if title:
            self.body.addWidget(label(title, "heading"))


def scrolled(widget: QWidget) -> QScrollArea:
    """Return a page that scrolls where the window is too small for it."""
    area = QScrollArea()
    widget.setProperty("role", "page")
    area.setWidget(widget)
    area.setWidgetResizable(True)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    return area
