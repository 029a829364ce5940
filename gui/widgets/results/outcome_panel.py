"""The outcome of a calibration: its figures against what is asked, its plot, and the verdict."""

import math

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QWidget

from daq.calibration_files.outcome import Figure
from gui.calibration.bench import Judged
from gui.widgets.cards import Card, button, label
from gui.widgets.lamp import Lamp

_PLOT_WIDTH = 640
# The units that people read, and how many of them make the unit of a figure.
_HANDY = {"m": ("mm", 1e3), "kg": ("g", 1e3), "N m": ("mN·m", 1e3)}


class OutcomePanel(Card):
    """``judged`` brings the operator's verdict: True to accept."""

    judged = Signal(bool)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Outcome", parent)
        self._figures = QGridLayout()
        self._figures.setHorizontalSpacing(14)
        self._figures.setColumnStretch(1, 1)
        self._plot = QLabel()
        self._plot.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.accept = button("Accept", "primary", "It is in force from now on, until it expires.")
        self.reject = button("Reject", tip="It is kept, and never in force.")
        self._told = label("", "muted")
        self.accept.clicked.connect(lambda: self.judged.emit(True))
        self.reject.clicked.connect(lambda: self.judged.emit(False))
        row = QHBoxLayout()
        row.addWidget(self.accept)
        row.addWidget(self.reject)
        row.addWidget(self._told, stretch=1)
        self.body.addLayout(row)
        self.body.addLayout(self._figures)
        self.body.addWidget(self._plot)
        self.hide()

    def show_outcome(self, outcome: Judged) -> None:
        """Show an outcome that waits for its verdict."""
        while (item := self._figures.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.deleteLater()
        for row, figure in enumerate(outcome.figures):
            if asked_told(figure) or not figure.passed:
                lamp = Lamp()
                lamp.show_health("good" if figure.passed else "bad")
                self._figures.addWidget(lamp, row, 0)
            self._figures.addWidget(label(figure.name), row, 1)
            self._figures.addWidget(_right(value_told(figure)), row, 2)
            self._figures.addWidget(label(asked_told(figure), "muted" if figure.passed else "bad"), row, 3)
        picture = QPixmap()
        picture.loadFromData(outcome.plot)
        self._plot.setPixmap(picture.scaledToWidth(_PLOT_WIDTH, Qt.TransformationMode.SmoothTransformation))
        self.accept.setEnabled(outcome.acceptable)
        self.reject.setEnabled(True)
        self._told.setText("" if outcome.acceptable else "a figure that is not met forbids to accept it")
        self.show()

    def show_kept(self, words: str) -> None:
        """Show that the verdict is given."""
        self.accept.setEnabled(False)
        self.reject.setEnabled(False)
        self._told.setText(words)


def value_told(figure: Figure) -> str:
    """Return the value with its unit."""
    return "–" if math.isnan(figure.value) else _in_handy_units(figure.value, figure.unit)


def asked_told(figure: Figure) -> str:
    """Return what is asked of it, empty where nothing is."""
    asked = [("at most", figure.most), ("at least", figure.least)]
    return ", ".join(
        f"{word} {_in_handy_units(limit, figure.unit)}" for word, limit in asked if limit is not None
    )


def _in_handy_units(value: float, unit: str) -> str:
    handy, factor = _HANDY.get(unit, (unit, 1.0))
    return f"{factor * value:.3g} {handy}".strip()


def _right(text: str) -> QLabel:
    made = QLabel(text)
    made.setProperty("role", "heading")
    made.setAlignment(Qt.AlignmentFlag.AlignRight)
    return made
