"""Tables that are read and not edited."""

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QGridLayout,
    QHeaderView,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from gui.widgets.cards import label


class ReadTable(QTableWidget):
    """Rows of texts under a head; whole rows are selected, or none where ``selectable`` is not asked for."""

    def __init__(
        self, head: Sequence[str], *, selectable: bool = False, parent: QWidget | None = None
    ) -> None:
        super().__init__(0, len(head), parent)
        self.setHorizontalHeaderLabels(list(head))
        # the arrow keys go from cell to cell; Tab leads on, and not round and round in here
        self.setTabKeyNavigation(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(
            QAbstractItemView.SelectionMode.SingleSelection
            if selectable
            else QAbstractItemView.SelectionMode.NoSelection
        )
        self.verticalHeader().hide()
        self.setShowGrid(False)
        self.setWordWrap(False)
        self.horizontalHeader().setDefaultAlignment(Qt.AlignmentFlag.AlignLeft)
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.horizontalHeader().setStretchLastSection(True)

    def show_table(self, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Show rows under another head."""
        self.setColumnCount(len(head))
        self.setHorizontalHeaderLabels(list(head))
        self.show_rows(rows)

    def show_rows(self, rows: Sequence[Sequence[str]]) -> None:
        """Show rows of as many texts as the head has."""
        self.setRowCount(len(rows))
        for row, texts in enumerate(rows):
            for column, text in enumerate(texts):
                item = QTableWidgetItem(text)
                item.setToolTip(text)
                self.setItem(row, column, item)


class Facts(QWidget):
    """Names with their values, one below the other."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(18)
        self._grid.setVerticalSpacing(4)
        self._grid.setColumnStretch(1, 1)

    def show_facts(self, facts: Mapping[str, str]) -> None:
        """Show these and no others."""
        while (item := self._grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        for row, (name, value) in enumerate(facts.items()):
            told = label(name, "muted")
            told.setWordWrap(False)
            self._grid.addWidget(told, row, 0, Qt.AlignmentFlag.AlignTop)
            self._grid.addWidget(label(value), row, 1)
        self._take_height()

    def event(self, event: QEvent) -> bool:
        """Take the height that the texts need, whatever else changes in them."""
        if event.type() == QEvent.Type.LayoutRequest:
            self._take_height()
        return super().event(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Take the height that the texts need at another width."""
        super().resizeEvent(event)
        self._take_height()

    def _take_height(self) -> None:
        """See to it that no wrapped text is cut where a page is short of room."""
        self.setMinimumHeight(max(self.heightForWidth(self.width()), 0))
