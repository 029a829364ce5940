"""Sessions: what has been recorded, how good it is, and what can be done with it."""

from pathlib import Path
from typing import ClassVar

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QFileDialog, QHBoxLayout, QTabWidget, QVBoxLayout, QWidget

from daq.errors import RecordingError
from daq.session_report import SessionReport, read_report
from gui.analysis.computations import EXPORTS, export_session, judge_session, repair_session
from gui.context import Context
from gui.messages import Message, information
from gui.sessions.session_list import SessionEntry
from gui.widgets.cards import Card, button, label, scrolled
from gui.widgets.forms.session_table import SessionTable
from gui.widgets.job_strip import JobStrip, failed
from gui.widgets.save_dialog import ask_where_to_save
from gui.widgets.split import side_by_side
from gui.widgets.tables import Facts
from gui.widgets.video.replay_pane import ReplayPane

_FORMS = {
    "experiment": "Experiment folder",
    "csv": "CSV tables",
    "parquet": "Parquet tables",
    "hdf5": "HDF5 file",
    "npz": "NPZ file",
}
_SUFFIXES = {"hdf5": ".h5", "npz": ".npz"}
_DETAILS, _REPLAY = 0, 1


class SessionsPage(QWidget):
    """Left the list, right the session that is looked at."""

    title: ClassVar[str] = "Sessions"

    def __init__(self, context: Context, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._context = context
        self._dialog: QFileDialog | None = None
        self.strip = JobStrip(context.navigator.tell)
        self.strip.idle_changed.connect(self._on_idle_changed)
        self.replay = ReplayPane(context.rig)
        self.replay.failed.connect(lambda line: self._tell(failed("Cannot be replayed", line)))
        self._replayed: Path | None = None
        self.facts, self.quality = Facts(), label("", "muted")
        self.repair = button("Repair", "primary", "Seal what was recorded before the session was cut off")
        self.judge = button(
            "Judge anew", tip="Clocks, gaps and the alignment of the streams, from the raw stamps"
        )
        self.estimate = button("Estimate", tip="E and ν from this session")
        self.diagnose = button("Diagnose", tip="What the model leaves out, from this session")
        self.form = QComboBox()
        self.form.setAccessibleName("Format of the export")
        for form in EXPORTS:
            self.form.addItem(_FORMS[form], form)
        self.export = button("Export…", tip="Write it to a new file or folder")
        self.tabs = QTabWidget()
        self.tabs.setDocumentMode(True)
        self.tabs.addTab(scrolled(self._details()), "Details")
        self.tabs.addTab(self.replay, "Replay")
        self.tabs.currentChanged.connect(self._show_replay)
        # last, for it tells at once which session is looked at
        self.table = SessionTable(context.sessions_folder)
        self._lay_out()
        self._wire()
        self._show(self.table.entry)

    def _lay_out(self) -> None:
        right = QWidget()
        column = QVBoxLayout(right)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(self._actions())
        column.addWidget(self.strip)
        column.addWidget(self.tabs, 1)
        layout = QVBoxLayout(self)
        layout.addWidget(label(self.title, "title"))
        layout.addWidget(side_by_side(self.table, right, (480, 760)), 1)

    def _actions(self) -> QHBoxLayout:
        row = QHBoxLayout()
        for widget in (self.repair, self.estimate, self.diagnose, self.judge):
            row.addWidget(widget)
        row.addStretch()
        row.addWidget(self.form)
        row.addWidget(self.export)
        return row

    def _details(self) -> QWidget:
        made = QWidget()
        layout = QVBoxLayout(made)
        layout.setAlignment(Qt.AlignmentFlag.AlignTop)
        told, judged = Card("Session"), Card("Quality")
        told.body.addWidget(self.facts)
        judged.body.addWidget(self.quality)
        layout.addWidget(told)
        layout.addWidget(judged)
        return made

    def _wire(self) -> None:
        navigator = self._context.navigator
        self.table.chosen.connect(self._show)
        self.repair.clicked.connect(self._repair)
        self.judge.clicked.connect(self._judge)
        self.estimate.clicked.connect(lambda: navigator.estimate_requested.emit(self._folders()))
        self.diagnose.clicked.connect(lambda: navigator.diagnose_requested.emit(self._folders()))
        self.export.clicked.connect(self._ask_where_to_export)
        navigator.session_recorded.connect(self.table.refresh)
        navigator.replay_requested.connect(self._replay)

    def _folders(self) -> tuple[Path, ...]:
        entry = self.table.entry
        return () if entry is None else (entry.folder,)

    def _replay(self, session: object) -> None:
        assert isinstance(session, Path)
        self.table.choose(session)
        self.tabs.setCurrentIndex(_REPLAY)

    def _show(self, entry: SessionEntry | None) -> None:
        self.facts.show_facts({} if entry is None else _facts_of(entry))
        self.quality.setText("" if entry is None else _quality_of(entry))
        self._show_actions()
        self._show_replay()

    def _show_actions(self) -> None:
        entry, idle = self.table.entry, self.strip.idle
        finished = entry is not None and entry.finished
        self.repair.setVisible(entry is not None and entry.condition == "cut off")
        self.repair.setEnabled(idle)
        for widget in (self.judge, self.export, self.form):
            widget.setEnabled(finished and idle)
        for widget in (self.estimate, self.diagnose):
            widget.setEnabled(finished)

    def _show_replay(self) -> None:
        """Open the session that is looked at once its replay is; reading it takes a moment."""
        entry = self.table.entry
        wanted = entry.folder if entry is not None and entry.info is not None else None
        if self.tabs.currentIndex() == _REPLAY and wanted != self._replayed:
            self._replayed = wanted
            if wanted is None:
                self.replay.close_session()
            else:
                self.replay.open(wanted)
        elif self.tabs.currentIndex() != _REPLAY:
            self.replay.play.setChecked(False)

    def _repair(self) -> None:
        (session,) = self._folders()
        job = self._context.jobs.start("Repairing", repair_session, session)
        self.strip.watch(job, "Not repaired")
        job.finished.connect(lambda kept: self._tell(information(f"{session.name} is repaired: {kept}")))

    def _judge(self) -> None:
        (session,) = self._folders()
        self.strip.watch(
            self._context.jobs.start("Judging the recording", judge_session, session), "Not judged"
        )

    def _ask_where_to_export(self) -> None:
        (session,) = self._folders()
        form = str(self.form.currentData())
        suffix = _SUFFIXES.get(form, "")
        kind = f"{_FORMS[form]} (*{suffix})" if suffix else ""
        self._dialog = ask_where_to_save(
            self,
            f"Export {session.name}",
            f"{session.name}_{form}{suffix}",
            kind,
            lambda target: self.export_to(session, form, target),
        )

    def export_to(self, session: Path, form: str, target: Path) -> None:
        """Export a session in one of the formats to a new place."""
        job = self._context.jobs.start(f"Exporting {_FORMS[form]}", export_session, session, form, target)
        self.strip.watch(job, "Not exported")
        job.finished.connect(lambda told: self._tell(information(f"Exported: {told}")))

    def _on_idle_changed(self) -> None:
        if self.strip.idle:
            self.table.refresh()
        self._show_actions()

    def _tell(self, message: Message) -> None:
        self._context.navigator.tell(message)


def _facts_of(entry: SessionEntry) -> dict[str, str]:
    info = entry.info
    if info is None:
        return {"folder": str(entry.folder), "state": entry.condition, "trouble": entry.trouble}
    samples = ", ".join(
        f"{count} × {topic}" for topic, count in info.samples.items() if "device" not in topic
    )
    facts = {
        "name": info.name,
        "folder": str(entry.folder),
        "state": entry.condition,
        "started": entry.started,
        "phantom": f"{info.phantom_id}, experiment {info.order} on this mounting",
        "trajectory": entry.trajectory,
        "operator": info.operator,
        "notes": info.notes,
        "samples": samples,
        "calibrations": ", ".join(f"{kind}: {told}" for kind, told in info.calibrations.items()),
        "problems": "; ".join(info.problems) or "none",
    }
    return {name: told for name, told in facts.items() if told}


def _quality_of(entry: SessionEntry) -> str:
    try:
        report: SessionReport = read_report(entry.folder)
    except RecordingError:
        return "Not judged yet." if entry.finished else "Judged once it is sealed."
    return "\n".join([*report.warnings, *report.lines()])
