"""Choosing what to compute from: finished sessions of the folder, and experiment folders from elsewhere."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QLineEdit, QListWidget, QListWidgetItem, QWidget

from gui.sessions.session_finder import SessionFinder
from gui.sessions.session_list import SessionEntry, matching
from gui.widgets.cards import Card, button, label

_PATH = Qt.ItemDataRole.UserRole


class SourcePicker(Card):
    """A list with a check box each.

    ``changed`` is emitted with every change of what is checked.
    """

    changed = Signal()

    def __init__(self, title: str, sessions_folder: Path, parent: QWidget | None = None) -> None:
        super().__init__(title, parent)
        self._finder = SessionFinder(sessions_folder, self)
        self._finder.found.connect(self._on_found)
        self._finder.failed.connect(self._on_failed)
        self._elsewhere: list[Path] = []
        self._finished: tuple[SessionEntry, ...] = ()
        self._dialog: QFileDialog | None = None
        self.filter = QLineEdit()
        self.filter.setPlaceholderText("filter by name, phantom, trajectory")
        self.filter.setClearButtonEnabled(True)
        self.filter.textChanged.connect(lambda: self._fill(self.chosen()))
        self.list = QListWidget()
        self.list.setAccessibleName(title)
        self.list.setSpacing(2)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.itemChanged.connect(self.changed)
        self._none = label(
            "No finished session yet. Record one on the Acquire page, or add a folder.", "muted"
        )
        add = button("Add folder…", tip="An experiment folder, or a folder of several, from elsewhere")
        add.clicked.connect(self._ask_for_folder)
        again = button("Refresh", "flat", "Look for new sessions")
        again.clicked.connect(self.refresh)
        below = QHBoxLayout()
        below.addWidget(add)
        below.addStretch()
        below.addWidget(again)
        self.body.addWidget(self.filter)
        self.body.addWidget(self._none, 1, Qt.AlignmentFlag.AlignTop)
        self.body.addWidget(self.list, 4)
        self.body.addLayout(below)
        self.refresh()

    def chosen(self) -> tuple[Path, ...]:
        """Return the folders that are checked, in the order of the list."""
        items = [self.list.item(row) for row in range(self.list.count())]
        return tuple(item.data(_PATH) for item in items if item.checkState() == Qt.CheckState.Checked)

    def choose(self, sources: Sequence[Path]) -> None:
        """Check these folders and no other; those from elsewhere are added to the list."""
        wanted = tuple(path.absolute() for path in sources)
        known = {entry.folder for entry in self._finished}
        self._elsewhere += [path for path in wanted if path not in known and path not in self._elsewhere]
        self.filter.clear()
        self._fill(wanted)
        self.refresh()

    def refresh(self) -> None:
        """Look for new sessions, and keep what is checked."""
        self._finder.look()

    def _on_found(self, entries: tuple[SessionEntry, ...]) -> None:
        checked = self.chosen()
        self._finished = tuple(entry for entry in entries if entry.finished)
        known = {entry.folder for entry in self._finished}
        self._elsewhere = [path for path in self._elsewhere if path not in known]
        self._fill(checked)

    def _on_failed(self, why: str) -> None:
        self._none.setText(why)
        self._none.show()

    def _fill(self, checked: Sequence[Path]) -> None:
        shown = [
            entry
            for entry in self._finished
            if entry.folder in checked or entry in matching([entry], self.filter.text())
        ]
        self.list.blockSignals(True)
        self.list.clear()
        for path in self._elsewhere:
            self._add(path, path.name, str(path), path in checked)
        for entry in shown:
            self._add(entry.folder, _line(entry), str(entry.folder), entry.folder in checked)
        self.list.blockSignals(False)
        self._none.setVisible(self.list.count() == 0)
        self.list.setVisible(self.list.count() > 0)
        self.changed.emit()

    def _add(self, path: Path, text: str, tip: str, checked: bool) -> None:
        item = QListWidgetItem(text)
        item.setData(_PATH, path)
        item.setToolTip(tip)
        item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
        item.setCheckState(Qt.CheckState.Checked if checked else Qt.CheckState.Unchecked)
        self.list.addItem(item)

    def _ask_for_folder(self) -> None:
        self._dialog = dialog = QFileDialog(self, "An experiment folder, or a folder of several")
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        dialog.setModal(False)
        dialog.fileSelected.connect(lambda name: self.choose((*self.chosen(), Path(name))))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.show()


def _line(entry: SessionEntry) -> str:
    assert entry.info is not None
    told = [entry.info.phantom_id, entry.trajectory, entry.started[:16]]
    return " · ".join(part for part in told if part) + ("  ⚠" if entry.info.problems else "")
