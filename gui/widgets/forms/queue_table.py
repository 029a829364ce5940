"""The queue as a table, and what can be done with its entries."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QSizePolicy,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from daq.errors import DaqError
from daq.plans import Trial
from gui.recording.motion_profile import in_words, motion_profile
from gui.recording.work_queue import Entry, Queue, changed, moved, repeated, without
from gui.widgets.cards import button
from gui.widgets.forms.retraction_card import NAMES

_COLUMNS = ("state", "retraction", "duration", "notes", "session")


class QueueTable(QWidget):
    """Shows a queue; ``edited`` brings the queue that the operator wants instead."""

    edited = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._queue: Queue = ()
        self._rendering = False
        self.table = QTableWidget(0, len(_COLUMNS))
        self.table.setHorizontalHeaderLabels(_COLUMNS)
        self.table.setAccessibleName("queue of sessions")
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setEditTriggers(
            QAbstractItemView.EditTrigger.DoubleClicked | QAbstractItemView.EditTrigger.EditKeyPressed
        )
        self.table.setMinimumHeight(110)
        self.table.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        self.table.setTabKeyNavigation(False)
        self.table.verticalHeader().setDefaultSectionSize(26)
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        for wide in ("notes", "session"):
            header.setSectionResizeMode(_COLUMNS.index(wide), QHeaderView.ResizeMode.Stretch)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft)
        self.table.itemChanged.connect(self._on_note)
        row = QHBoxLayout()
        for text, tip, edit in (
            ("Up", "earlier", lambda queue, place: moved(queue, place, -1)),
            ("Down", "later", lambda queue, place: moved(queue, place, 1)),
            ("Repeat", "the same once more", repeated),
            ("Remove", "take it out; its session stays", lambda queue, place: without(queue, [place])),
        ):
            made = button(text, "flat", tip)
            made.clicked.connect(self._editor(edit))
            row.addWidget(made)
        row.addStretch(1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        column.addWidget(self.table)
        column.addLayout(row)

    def show_queue(self, queue: Queue) -> None:
        """Show a queue; the selection stays with its row."""
        place = self.table.currentRow()
        self._rendering = True
        self._queue = queue
        self.table.setRowCount(len(queue))
        for row, entry in enumerate(queue):
            for column, text in enumerate(_cells(entry)):
                item = QTableWidgetItem(text)
                item.setToolTip(entry.remark or text)
                if column != 3:
                    item.setFlags(item.flags() & ~Qt.ItemFlag.ItemIsEditable)
                self.table.setItem(row, column, item)
        self._rendering = False
        if 0 <= place < len(queue):
            self.table.selectRow(place)

    def _editor(self, edit: Callable[[Queue, int], Queue]) -> Callable[[], None]:
        def act() -> None:
            place = self.table.currentRow()
            if 0 <= place < len(self._queue):
                self.edited.emit(edit(self._queue, place))

        return act

    def _on_note(self, item: QTableWidgetItem) -> None:
        if self._rendering:
            return
        entry = self._queue[item.row()]
        self.edited.emit(changed(self._queue, item.row(), with_notes(entry, item.text())))


def with_notes(entry: Entry, notes: str) -> Entry:
    """Return an entry with other notes."""
    return replace(entry, trial=replace(entry.trial, notes=notes))


def _cells(entry: Entry) -> tuple[str, ...]:
    state = f"{entry.state}: {entry.remark}" if entry.remark and entry.state != "waiting" else entry.state
    return (
        state if len(state) < 40 else f"{state[:38]}…",
        described(entry.trial),
        _duration(entry.trial),
        entry.trial.notes,
        "" if entry.session is None else entry.session.name,
    )


def described(trial: Trial) -> str:
    """Return what a trial is, in a few words with units."""
    told = {str(kind): name for kind, name in NAMES.items()}.get(trial.trajectory, trial.trajectory)
    if trial.steps is not None and trial.step_length_m is not None:
        told += f", {trial.steps} × {1e3 * trial.step_length_m:g} mm"
    return f"{told}, {trial.rounds} rounds" if trial.rounds > 1 else told


def _duration(trial: Trial) -> str:
    try:
        return in_words(motion_profile(trial.lay_out(Path())).duration_s)
    except DaqError:
        return "–"
