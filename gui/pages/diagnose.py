"""Diagnose: where model and measurements part, which cause explains it, and what to do next."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import ClassVar

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QListWidget, QSplitter, QVBoxLayout, QWidget

from daq.plans.advised import advised_trial
from estimator.diagnosis.result import Advice, Consideration, Diagnosis
from estimator.report.diagnosis.findings import answer_words
from gui.analysis.computations import diagnose_sources, try_cause, write_diagnosis_page
from gui.context import Context
from gui.messages import information
from gui.widgets.cards import Card, button, label
from gui.widgets.forms.source_picker import SourcePicker
from gui.widgets.job_strip import WAIT, JobStrip
from gui.widgets.results.diagnosis_result import Diagnosed, DiagnosisResult
from gui.widgets.save_dialog import ask_where_to_save
from gui.widgets.split import side_by_side

MANOEUVRES_FOLDER = "manoeuvres"
_HINT = (
    "Choose all sessions of one phantom in one mounting on the left and press Diagnose. It takes some minutes; "
    "the robot may go on meanwhile."
)


class DiagnosePage(QWidget):
    """Left what to diagnose and what has been diagnosed, right what came out."""

    title: ClassVar[str] = "Diagnose"

    def __init__(self, context: Context, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._context = context
        self._diagnosed: list[Diagnosed] = []
        self._dialog: QFileDialog | None = None
        self.picker = SourcePicker("Sessions", context.sessions_folder)
        self.picker.changed.connect(self._show_readiness)
        self.begin = button("Diagnose", "primary", "Look for the cause of the gap in what is checked")
        self.begin.clicked.connect(self._begin)
        self.history = QListWidget()
        self.history.setAccessibleName("Diagnoses since the window was opened")
        self.history.setWordWrap(True)
        self.history.setSpacing(2)
        self.history.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.history.currentRowChanged.connect(self._show)
        self.strip = JobStrip(context.navigator.tell)
        self.strip.idle_changed.connect(self._show_readiness)
        self.result = DiagnosisResult()
        self.result.hide()
        self.result.cause_wanted.connect(self._try_cause)
        self.result.manoeuvre_wanted.connect(self._queue)
        self.result.save.clicked.connect(self._ask_where_to_save)
        self._hint = label(_HINT, "muted")
        layout = QVBoxLayout(self)
        layout.addWidget(label(self.title, "title"))
        layout.addWidget(self._split(), 1)
        context.navigator.diagnose_requested.connect(self._begin_with)
        context.navigator.session_recorded.connect(self.picker.refresh)
        self._show_readiness()

    def add(self, diagnosis: Diagnosis, sources: tuple[Path, ...]) -> None:
        """Keep a diagnosis for as long as the window is open, and show it."""
        name = f"{diagnosis.traces[0].experiment.phantom_id}: {', '.join(diagnosis.by_experiment)}"
        moment = f"{datetime.now().astimezone():%H:%M}"
        self._diagnosed.append(Diagnosed(f"{name} ({moment})", sources, diagnosis))
        self.history.addItem(self._diagnosed[-1].name)
        self.history.setCurrentRow(len(self._diagnosed) - 1)

    def _split(self) -> QSplitter:
        left, right = QWidget(), QWidget()
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.picker, 2)
        column.addWidget(self.begin)
        kept = Card("Diagnoses")
        kept.body.addWidget(self.history)
        column.addWidget(kept, 1)
        beside = QVBoxLayout(right)
        beside.setContentsMargins(0, 0, 0, 0)
        beside.addWidget(self.strip)
        beside.addWidget(self._hint, 0, Qt.AlignmentFlag.AlignTop)
        beside.addWidget(self.result, 1)
        return side_by_side(left, right, (300, 900))

    def _begin_with(self, sources: object) -> None:
        assert isinstance(sources, tuple)
        self.picker.choose(sources)
        self._begin()

    def _begin(self) -> None:
        if not self.begin.isEnabled():
            return
        sources = self.picker.chosen()
        job = self._context.jobs.start("Diagnosing", diagnose_sources, sources)
        self.strip.watch(job, "No diagnosis")
        job.finished.connect(lambda found: self.add(found, sources))

    def _try_cause(self, cause: str) -> None:
        shown = self.result.shown
        if shown is None or not self.strip.idle:
            return
        title, diagnosis = f"Adding {answer_words(cause)} to the model", shown.diagnosis
        noise = diagnosis.gap.floor, diagnosis.errors_left
        job = self._context.jobs.start(title, try_cause, shown.sources, cause, *noise)
        self.strip.watch(job, "The cause was not added")
        job.finished.connect(lambda found: self._consider(shown, cause, found))

    def _consider(self, shown: Diagnosed, cause: str, found: Consideration) -> None:
        """Put what a cause does into the diagnosis that it was asked for, and look at it."""
        diagnosis = replace(shown.diagnosis, considered={**shown.diagnosis.considered, cause: found})
        number = self._diagnosed.index(shown)
        self._diagnosed[number] = replace(shown, diagnosis=diagnosis)
        self.history.setCurrentRow(number)
        self._show(number)
        self.result.ranking.choose(cause)

    def _show(self, number: int) -> None:
        if 0 <= number < len(self._diagnosed):
            self._hint.hide()
            self.result.show()
            self.result.show_diagnosis(self._diagnosed[number], self._diagnosed)

    def _show_readiness(self) -> None:
        self.begin.setEnabled(bool(self.picker.chosen()) and self.strip.idle)

    def _queue(self, advice: Advice) -> None:
        if advice.motion is not None:
            trial = advised_trial(advice.motion, self._context.sessions_folder / MANOEUVRES_FOLDER)
            self._context.navigator.trial_requested.emit(trial)

    def _ask_where_to_save(self) -> None:
        title = "Save the report of the diagnosis"
        self._dialog = ask_where_to_save(self, title, "diagnosis.html", "HTML page (*.html)", self.save)

    def save(self, page: Path) -> None:
        """Write the report of what is shown to a file; while something is being computed, that has to end first."""
        if self.result.shown is None:
            return
        if not self.strip.idle:
            self._context.navigator.tell(information("No report yet: a computation is running.", WAIT))
            return
        job = self._context.jobs.start(
            "Writing the report", write_diagnosis_page, self.result.shown.diagnosis, page
        )
        self.strip.watch(job, "No report")
        job.finished.connect(
            lambda path: self._context.navigator.tell(information(f"Report written to {path}"))
        )
