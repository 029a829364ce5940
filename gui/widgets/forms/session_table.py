"""The list of recorded sessions with its filter."""

from pathlib import Path
from typing import get_args

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLineEdit, QWidget

from gui.sessions.session_finder import SessionFinder
from gui.sessions.session_list import Condition, SessionEntry, entry_of, matching
from gui.widgets.cards import Card, button, label
from gui.widgets.tables import ReadTable

_ALL = "all states"


class SessionTable(Card):
    """Sessions of a folder, the newest first; ``chosen`` tells the entry of the one that is looked at."""

    chosen = Signal(object)

    def __init__(self, sessions_folder: Path, parent: QWidget | None = None) -> None:
        super().__init__("Recorded sessions", parent)
        self._finder = SessionFinder(sessions_folder, self)
        self._finder.found.connect(self._on_found)
        self._finder.failed.connect(self._on_failed)
        self.folder = self._finder.folder
        self._entries: tuple[SessionEntry, ...] | None = None
        self._shown: tuple[SessionEntry, ...] = ()
        self.filter = QLineEdit()
        self.filter.setPlaceholderText("filter by name, phantom, operator, notes")
        self.filter.setClearButtonEnabled(True)
        self.filter.textChanged.connect(self._fill)
        self.condition = QComboBox()
        self.condition.setAccessibleName("State of the sessions")
        self.condition.addItems([_ALL, *get_args(Condition)])
        self.condition.currentIndexChanged.connect(self._fill)
        self.table = ReadTable(("started", "phantom", "trajectory", "state"), selectable=True)
        self.table.setAccessibleName("Recorded sessions")
        self.table.itemSelectionChanged.connect(self._tell)
        self._none = label("", "muted")
        again = button("Refresh", "flat", "Look for new sessions")
        again.clicked.connect(self.refresh)
        row = QHBoxLayout()
        row.addWidget(self.filter, 1)
        row.addWidget(self.condition)
        self.body.addLayout(row)
        self.body.addWidget(self.table, 1)
        self.body.addWidget(self._none)
        self.body.addWidget(again)
        self._fill()
        self.refresh()

    def refresh(self) -> None:
        """Look for sessions anew, and go on looking at the same one."""
        entries = self._entries or ()
        self._finder.look([entry.folder for entry in entries if entry.folder.parent != self.folder])

    def choose(self, session: Path) -> None:
        """Look at a session; one from elsewhere joins the list."""
        self.filter.clear()
        self.condition.setCurrentIndex(0)
        wanted, entries = session.absolute(), self._entries or ()
        if wanted not in [entry.folder for entry in entries]:
            self._entries = (entry_of(wanted), *entries)
        self._fill(wanted)
        self.refresh()

    def _on_found(self, entries: tuple[SessionEntry, ...]) -> None:
        self._entries = entries
        self._fill()

    def _on_failed(self, why: str) -> None:
        self._none.setText(why)
        self._none.show()

    @property
    def entry(self) -> SessionEntry | None:
        """What is looked at."""
        rows = self.table.selectionModel().selectedRows()
        return self._shown[rows[0].row()] if rows else None

    def _fill(self, session: object = None) -> None:
        present = self.entry
        wanted = session if isinstance(session, Path) else None if present is None else present.folder
        condition = "" if self.condition.currentIndex() == 0 else self.condition.currentText()
        self._shown = matching(self._entries or (), self.filter.text(), condition)
        self.table.blockSignals(True)
        self.table.clearSelection()
        self.table.show_rows([texts_of(entry) for entry in self._shown])
        self.table.blockSignals(False)
        self._none.setText(self._emptiness())
        self._none.setVisible(not self._shown)
        folders = [entry.folder for entry in self._shown]
        if folders:
            self.table.selectRow(folders.index(wanted) if wanted in folders else 0)
        else:
            self.chosen.emit(None)

    def _emptiness(self) -> str:
        if self._entries is None:
            return f"Looking for sessions in {self.folder}."
        if self._entries:
            return "No session matches the filter."
        return f"No session in {self.folder} yet. Record one on the Acquire page."

    def _tell(self) -> None:
        self.chosen.emit(self.entry)


def texts_of(entry: SessionEntry) -> tuple[str, str, str, str]:
    """Return the row of a session: when, on what, which trajectory, and how it stands with its problems."""
    phantom = "" if entry.info is None else entry.info.phantom_id
    problems = () if entry.info is None else entry.info.problems
    return (
        entry.started or entry.folder.name,
        phantom,
        entry.trajectory,
        f"{entry.condition} ⚠ {'; '.join(problems)}" if problems else entry.condition,
    )
