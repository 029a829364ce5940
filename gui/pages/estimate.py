"""Estimate: Young's modulus and Poisson's ratio of finished sessions, and what the fit leaves unexplained."""

from pathlib import Path
from typing import ClassVar

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QCheckBox, QComboBox, QFileDialog, QVBoxLayout, QWidget

from daq.acquisition.viewing.channels import Analysis
from estimator.errors import InputError
from estimator.fit.online import OnlineEstimate
from estimator.fit.result import Estimate
from estimator.materials import LAWS, installed_laws
from gui.analysis.computations import estimate_sources, write_estimate_page
from gui.analysis.following import FollowedStep, follow_session
from gui.context import Context
from gui.messages import information
from gui.rig.state import RigState
from gui.widgets.cards import button, label
from gui.widgets.forms.source_picker import SourcePicker
from gui.widgets.job_strip import WAIT, JobStrip
from gui.widgets.results.estimate_result import EstimateResult
from gui.widgets.save_dialog import ask_where_to_save
from gui.widgets.split import side_by_side
from robot_drivers.clock import host_time_ns


class EstimatePage(QWidget):
    """Left what to estimate from, right what came out.

    ``step_shown`` tells a step of a running session whose estimate is shown, and how long ago it was measured, s.
    """

    title: ClassVar[str] = "Estimate"
    step_shown = Signal(int, float)

    def __init__(self, context: Context, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._context = context
        self._sources: tuple[Path, ...] = ()
        self.estimate: Estimate | None = None
        self.picker = SourcePicker("Sessions", context.sessions_folder)
        self.picker.changed.connect(self._show_readiness)
        self.begin = button("Estimate", "primary", "Fit E and ν to what is checked; takes a minute or so")
        self.begin.clicked.connect(self._begin)
        self.law = QComboBox()
        self.law.setAccessibleName("Material law")
        self.law.setToolTip(
            "The law whose parameters are estimated; a running session is followed by the first"
        )
        self.law.addItems(self._laws())
        self.follow = QCheckBox("Estimate while a session is recorded")
        self.follow.setToolTip(
            "E and ν are renewed after each step; the next session that begins is followed"
        )
        self.follow.toggled.connect(self._take_follow)
        self._followed: Path | None = None
        self._history: list[OnlineEstimate] = []
        self.strip = JobStrip(context.navigator.tell)
        self.strip.idle_changed.connect(self._show_readiness)
        self.result = EstimateResult()
        self.result.save.clicked.connect(self._ask_where_to_save)
        self.result.diagnose.clicked.connect(self._diagnose)
        self._dialog: QFileDialog | None = None
        left = QWidget()
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.picker, 1)
        column.addWidget(self.law)
        column.addWidget(self.begin)
        column.addWidget(self.follow)
        right = QWidget()
        beside = QVBoxLayout(right)
        beside.setContentsMargins(0, 0, 0, 0)
        beside.addWidget(self.strip)
        beside.addWidget(self.result, 1)
        layout = QVBoxLayout(self)
        layout.addWidget(label(self.title, "title"))
        layout.addWidget(side_by_side(left, right, (300, 900)), 1)
        context.navigator.estimate_requested.connect(self._begin_with)
        context.navigator.session_recorded.connect(self.picker.refresh)
        context.link.state_changed.connect(self._follow)
        self._show_readiness()

    def show_estimate(self, estimate: Estimate) -> None:
        """Show what came out."""
        self.estimate = estimate
        self.result.show_estimate(estimate)

    def show_step(self, found: FollowedStep) -> None:
        """Show what the steps so far of the running session tell."""
        self._history.append(found.estimate)
        late_s = (host_time_ns() - found.measured_ns) * 1e-9
        self.result.show_history(self._history, late_s)
        self.step_shown.emit(found.estimate.step, late_s)
        told = {name: (one.value, *one.interval95) for name, one in found.estimate.parameters.items()}
        self._context.link.show(Analysis(found.measured_ns, found.estimate.step, found.beads, told))

    def _laws(self) -> list[str]:
        """Return the laws to choose from; those of this project alone where another package is broken."""
        try:
            return list(installed_laws())
        except InputError as error:
            complaint = information(str(error))
            # once there is a window that shows it
            QTimer.singleShot(0, self, lambda: self._context.navigator.tell(complaint))
            return list(LAWS)

    def _show_whole(self, found: Estimate | None) -> None:
        if found is not None:
            self.show_estimate(found)

    def _take_follow(self, wanted: bool) -> None:
        if wanted:
            # the first step is too soon for a process that has yet to load its libraries
            self._context.jobs.prepare()
            self._follow(self._context.link.state)

    def _follow(self, state: RigState) -> None:
        """Begin to estimate from a session that has just begun, where that is wanted."""
        session = state.session
        if session is None or session == self._followed or not self.follow.isChecked() or not self.strip.idle:
            return
        self._followed, self._history, self._sources = session, [], (session,)
        job = self._context.jobs.start("Estimating while it is recorded", follow_session, session)
        self.strip.watch(job, "No estimate")
        job.shown.connect(self.show_step)
        job.finished.connect(self._show_whole)

    def _begin_with(self, sources: object) -> None:
        assert isinstance(sources, tuple)
        self.picker.choose(sources)
        self._begin()

    def _begin(self) -> None:
        if not self.begin.isEnabled():
            return
        self._sources = self.picker.chosen()
        job = self._context.jobs.start(
            "Estimating E and ν", estimate_sources, self._sources, self.law.currentText()
        )
        self.strip.watch(job, "No estimate")
        job.finished.connect(self.show_estimate)

    def _show_readiness(self) -> None:
        self.begin.setEnabled(bool(self.picker.chosen()) and self.strip.idle)

    def _diagnose(self) -> None:
        self._context.navigator.diagnose_requested.emit(self._sources)

    def _ask_where_to_save(self) -> None:
        title = "Save the report of the estimation"
        self._dialog = ask_where_to_save(self, title, "estimation.html", "HTML page (*.html)", self.save)

    def save(self, page: Path) -> None:
        """Write the report of what is shown to a file; while something is being computed, that has to end first."""
        if not self.strip.idle:
            self._context.navigator.tell(information("No report yet: a computation is running.", WAIT))
            return
        job = self._context.jobs.start("Writing the report", write_estimate_page, self.estimate, page)
        self.strip.watch(job, "No report")
        job.finished.connect(
            lambda path: self._context.navigator.tell(information(f"Report written to {path}"))
        )
