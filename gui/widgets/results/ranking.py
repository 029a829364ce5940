"""The ranking of causes, each with a bar as long as it is probable."""

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import QStyledItemDelegate, QStyleOptionViewItem, QWidget

from estimator.diagnosis.result import Diagnosis
from estimator.report.diagnosis.findings import answer_words, ranking, standing
from estimator.report.diagnosis.quantities import STATE_WORDS
from gui.inks import colour
from gui.theme import theme_of
from gui.widgets.tables import ReadTable

_PROBABILITY = 1
_SHARE = Qt.ItemDataRole.UserRole
_BAR_OPACITY = 90


@dataclass(frozen=True, slots=True)
class RankedCause:
    """One line of the ranking; ``share`` is its probability, and ``named`` whether the verdict names it."""

    label: str
    texts: tuple[str, str, str]
    share: float
    named: bool


def ranked_causes(diagnosis: Diagnosis) -> list[RankedCause]:
    """Return the answers worth showing, and then every other effect of the catalogue."""
    leading = [label for label, _ in ranking(diagnosis)]
    others = sorted(
        set(diagnosis.effects) - set(leading), key=lambda one: -diagnosis.probabilities.get(one, 0.0)
    )
    found = []
    for label in [*leading, *others]:
        finding = diagnosis.effects.get(label)
        state = STATE_WORDS[finding.state] if finding is not None else ""
        texts = (answer_words(label), standing(diagnosis, label), state)
        share = diagnosis.probabilities.get(label, 0.0)
        found.append(RankedCause(label, texts, share, label in diagnosis.verdict))
    return found


class Ranking(ReadTable):
    """A table of causes; ``chosen`` tells the label of the one that is looked at."""

    chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(("cause", "probability", "state"), selectable=True, parent=parent)
        self._causes: tuple[RankedCause, ...] = ()
        self.setAccessibleName("Ranking of causes")
        self.setItemDelegateForColumn(_PROBABILITY, _Bar(self))
        self.itemSelectionChanged.connect(self._tell)

    def show_causes(self, causes: Sequence[RankedCause]) -> None:
        """Show a ranking, and look at its first cause."""
        self._causes = tuple(causes)
        self.blockSignals(True)
        self.clearSelection()
        self.show_rows([cause.texts for cause in causes])
        for row, cause in enumerate(causes):
            name, probability = self.item(row, 0), self.item(row, _PROBABILITY)
            assert name is not None and probability is not None
            probability.setData(_SHARE, cause.share)
            font = name.font()
            font.setBold(cause.named)
            name.setFont(font)
        self.blockSignals(False)
        if causes:
            self.selectRow(0)

    def choose(self, label: str) -> None:
        """Look at a cause, as a click does."""
        self.selectRow([cause.label for cause in self._causes].index(label))

    def _tell(self) -> None:
        rows = self.selectionModel().selectedRows()
        if rows:
            self.chosen.emit(self._causes[rows[0].row()].label)


class _Bar(QStyledItemDelegate):
    """Paints a share behind its text."""

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        """Draw the bar, then the text."""
        cell = QRectF(option.rect).adjusted(2, 4, -2, -4)
        paint = QColor(colour("predicted", theme_of(self._table())))
        paint.setAlpha(_BAR_OPACITY)
        cell.setWidth(cell.width() * float(index.data(_SHARE) or 0.0))
        painter.fillRect(cell, paint)
        super().paint(painter, option, index)

    def _table(self) -> QWidget:
        table = self.parent()
        assert isinstance(table, QWidget)
        return table
