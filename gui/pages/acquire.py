"""The Acquire page: what to record, the queue, and what the rig is doing meanwhile."""

from dataclasses import replace

from PySide6.QtWidgets import (
    QHBoxLayout,
    QLineEdit,
    QProgressBar,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from daq.acquisition.messages import Checked, Telemetry
from daq.errors import DaqError
from daq.frames import compose, inverse
from daq.plans import Trial
from daq.rig import Rig
from daq.session.checks import check_limits, tool_targets
from daq.trajectories import Trajectory
from gui.context import Context
from gui.recording.queue_runner import Labels, QueueRunner
from gui.recording.work_queue import Queue, next_place
from gui.rig.bead_finder import BeadFinder
from gui.rig.state import RigState
from gui.widgets.cards import Card, button, label, set_role
from gui.widgets.forms.queue_table import QueueTable
from gui.widgets.forms.trial_panel import TrialPanel
from gui.widgets.plots.force_plot import ForcePlot
from gui.widgets.rig.readings import PoseReadings
from gui.widgets.split import ScrolledSides
from gui.widgets.video.camera_preview import CameraPreview
from robot_drivers.protocols import Pose


class AcquirePage(QWidget):
    """Left what is to be done, right what happens."""

    title = "Acquire"

    def __init__(self, context: Context, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._context = context
        self.runner = QueueRunner(context, self)
        self._beads = BeadFinder(context.link, self)
        self.trial_panel = TrialPanel(context.rig)
        self._verdict = label("", "muted")
        self.check_button = button(
            "Check", tip="Checks limits and reach from where the robot stands. Nothing moves."
        )
        self.add_button = button("Add to queue")
        self.start_button = button("Record now", "primary", "Puts it first and begins. The robot moves.")
        self.queue = QueueTable()
        self.run_button = button("Run queue", "primary", "Records all that waits, as long as each ends well.")
        self.next_button = button("Run next", tip="Records the first that waits.")
        self.pause_button = button("Pause", tip="Ends after the session that runs.")
        self._operator, self._order = QLineEdit(), QSpinBox()
        self._force = ForcePlot(context.rig.limits)
        cameras = context.rig.cameras
        self._preview = CameraPreview([camera.name for camera in cameras])
        self._pose = PoseReadings()
        self._progress = QProgressBar()
        self._step = label("nothing is recorded", "muted")
        self._note, self._note_button = (
            QLineEdit(),
            button("Note", tip="Records what you write, with its time."),
        )
        self._lay_out()
        self._wire()
        self.runner.load()
        self._check_in_thought()
        self._show_state(context.link.state)

    # ---- layout

    def _lay_out(self) -> None:
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(ScrolledSides(self._plan_side(), self._live_side(), (11, 10)))

    def _plan_side(self) -> QWidget:
        side = QWidget()
        column = QVBoxLayout(side)
        column.setContentsMargins(20, 16, 12, 16)
        column.setSpacing(12)
        column.addWidget(label("Acquire", "title"))
        column.addWidget(self.trial_panel, stretch=1)
        row = QHBoxLayout()
        row.addWidget(self._verdict, stretch=1)
        for made in (self.check_button, self.add_button, self.start_button):
            row.addWidget(made)
        column.addLayout(row)
        queue = Card("Queue")
        queue.body.addWidget(self.queue)
        self._operator.setPlaceholderText("operator")
        self._operator.setAccessibleName("operator")
        self._order.setRange(1, 999)
        self._order.setPrefix("order ")
        self._order.setToolTip("1 for the first experiment on this mounting, 2 for the next, and so on")
        row = QHBoxLayout()
        row.addWidget(self._operator)
        row.addWidget(self._order)
        row.addStretch(1)
        for made in (self.pause_button, self.next_button, self.run_button):
            row.addWidget(made)
        queue.body.addLayout(row)
        column.addWidget(queue)
        return side

    def _live_side(self) -> QWidget:
        side = QWidget()
        column = QVBoxLayout(side)
        column.setContentsMargins(12, 16, 20, 16)
        column.setSpacing(12)
        progress = Card("Progress")
        progress.body.addWidget(self._step)
        progress.body.addWidget(self._progress)
        row = QHBoxLayout()
        self._note.setPlaceholderText("a remark for the recording")
        row.addWidget(self._note, stretch=1)
        row.addWidget(self._note_button)
        progress.body.addLayout(row)
        force = Card("Force and torque, sensor frame")
        force.body.addWidget(self._force)
        cameras = Card("Cameras" if len(self._preview.panes) > 1 else "Camera")
        cameras.body.addWidget(self._preview)
        pose = Card("Gripper from its grasp, tissue frame")
        pose.body.addWidget(self._pose)
        column.addWidget(progress)
        column.addWidget(force, stretch=3)
        column.addWidget(cameras, stretch=2)
        column.addWidget(pose)
        return side

    def _wire(self) -> None:
        link = self._context.link
        link.state_changed.connect(self._show_state)
        link.telemetry.connect(self._show_telemetry)
        link.checked.connect(self._on_checked)
        link.opened.connect(lambda _: self._on_opened(link.rig))
        self._context.navigator.trial_requested.connect(self.runner.add)
        self._beads.found.connect(self._preview.show_beads)
        self._context.navigator.calibration_kept.connect(lambda _: self._beads.renew())
        self.trial_panel.trial_changed.connect(self._check_in_thought)
        self.check_button.clicked.connect(self._check)
        self.add_button.clicked.connect(self._add)
        self.start_button.clicked.connect(self._record_now)
        self.queue.edited.connect(self.runner.set_queue)
        self.runner.queue_changed.connect(self._show_queue)
        self.runner.labels_changed.connect(self._show_labels)
        self.run_button.clicked.connect(self.runner.run_all)
        self.next_button.clicked.connect(self.runner.run_next)
        self.pause_button.clicked.connect(self.runner.pause)
        self._operator.editingFinished.connect(self._take_labels)
        self._order.valueChanged.connect(lambda _: self._take_labels())
        self._note.returnPressed.connect(self._take_note)
        self._note_button.clicked.connect(self._take_note)

    # ---- what the operator does

    def _entered(self) -> tuple[Trial, Trajectory] | None:
        """Return what is entered; None, with the reason shown, where it cannot be right."""
        try:
            return self.trial_panel.trial(), self.trial_panel.trajectory()
        except DaqError as error:
            self._show_verdict(str(error), good=False)
            return None

    def _check_in_thought(self) -> None:
        """Check the limits of the rig from the grasp; whether the arm can follow, only the robot can tell."""
        if (entered := self._entered()) is None:
            return
        rig = self._context.link.rig
        try:
            check_limits(rig, entered[1], tool_targets(rig, entered[1], _tool_at_grasp(rig)))
        except DaqError as error:
            self._show_verdict(str(error), good=False)
        else:
            self._show_verdict(
                "within the limits of the rig; the reach is checked where the robot stands", good=True
            )

    def _check(self) -> None:
        if (entered := self._entered()) is not None:
            self._context.link.check(entered[1])

    def _on_checked(self, checked: Checked) -> None:
        if checked.failure is not None:
            self._show_verdict(checked.failure.message, good=False)
        else:
            self._show_verdict("within all limits and within reach from where the robot stands", good=True)

    def _show_verdict(self, text: str, *, good: bool) -> None:
        self._verdict.setText(text)
        set_role(self._verdict, "good" if good else "bad")

    def _add(self) -> None:
        if (entered := self._entered()) is not None:
            self.runner.add(entered[0])

    def _record_now(self) -> None:
        """Put what is entered before everything that waits, and begin."""
        if (entered := self._entered()) is None:
            return
        place = next_place(self.runner.queue)
        self.runner.add(replace(entered[0], repeat=1))
        queue = self.runner.queue
        if place is not None:
            self.runner.set_queue((*queue[:place], queue[-1], *queue[place:-1]))
        self.runner.run_next()

    def _take_labels(self) -> None:
        labels = replace(
            self.runner.labels, operator=self._operator.text().strip(), order=self._order.value()
        )
        self.runner.set_labels(labels)

    def _take_note(self) -> None:
        if text := self._note.text().strip():
            self._context.link.note(text)
            self._note.clear()

    # ---- what happens

    def _on_opened(self, rig: Rig) -> None:
        self._force.clear()
        self._force.set_limits(rig.limits)

    def _show_telemetry(self, seen: Telemetry) -> None:
        # a look now and then keeps the beads' names while another page is in front
        self._beads.watch(self.isVisible() or seen.session is not None)
        self._force.add(seen.force, self._context.link.state.zero)
        if self.isVisible():
            self._preview.show_images(seen.images)

    def _show_state(self, state: RigState) -> None:
        ready = state.phase == "ready"
        self.check_button.setEnabled(ready)
        self.start_button.setEnabled(ready)
        self._note_button.setEnabled(state.session is not None)
        self._enable_queue()
        if not self.isVisible():
            return
        self._pose.show_state(state, self._context.link.rig)
        self._progress.setMaximum(max(state.steps, 1))
        self._progress.setValue(state.step)
        self._progress.setFormat(f"step {state.step} of {state.steps}" if state.steps else "")
        self._step.setText(state.words if state.session is not None else "nothing is recorded")

    def _show_queue(self, queue: Queue) -> None:
        self.queue.show_queue(queue)
        self._enable_queue()

    def _enable_queue(self) -> None:
        waits = next_place(self.runner.queue) is not None
        ready = self._context.link.state.phase == "ready" and waits and not self.runner.running
        self.run_button.setEnabled(ready)
        self.next_button.setEnabled(ready)
        self.pause_button.setEnabled(self.runner.going_on)

    def _show_labels(self, labels: Labels) -> None:
        self._operator.setText(labels.operator)
        self._order.setValue(labels.order)


def _tool_at_grasp(rig: Rig) -> Pose:
    """Return ``T_base_tool`` with the gripper at the grasp."""
    T_base_gripper = compose(rig.frames.T_base_tissue.pose, Pose(rig.specimen.grasp.centre))
    return compose(T_base_gripper, inverse(rig.frames.T_tool_gripper.pose))
