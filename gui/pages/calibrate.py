"""The Calibrate page: what is in force, and a wizard for each kind that ends in accept or reject."""

import math

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from daq.acquisition.messages import Telemetry
from daq.calibration.by_board import SEEN_BY
from daq.calibration.collected_views import SIDES
from daq.calibration.of_rig import kinds_of
from daq.calibration.procedures import MOTIONS
from daq.calibration.tool import FEWEST_TOUCHES, LEAST_TURN_DEG
from daq.calibration_files.in_force import calibrations_in_force, why_unused
from daq.calibration_files.outcome import Kind
from daq.errors import DaqError
from daq.rig import Rig
from daq.vision.charuco import CharucoBoard
from gui.calibration.bench import Judged, Kept, TouchTaken, ViewTaken
from gui.calibration.wizard import CalibrationWizard
from gui.context import Context
from gui.messages import information
from gui.rig.laboratory import STANDARD, Laboratory
from gui.rig.state import RigState
from gui.widgets.cards import Card, button, label, scrolled
from gui.widgets.forms.parameter_form import ParameterForm
from gui.widgets.plots.coverage_map import CoverageMap
from gui.widgets.results.outcome_panel import OutcomePanel
from gui.widgets.split import BesideOrBelow
from gui.widgets.video.camera_preview import CameraPreview
from robot_drivers.protocols import DeviceIdentity

_HINTS: dict[Kind, str] = {
    "camera": "The only camera, in the tissue frame. In the first view the board lies flat on the middle of the "
    "phantom; then show it in the whole field, near and far, tilted up to 45°.",
    "cameras": "The lens of each camera alone. Show the board in the whole field, near and far, tilted up to 45°.",
    "stereo": "Both cameras together, in the tissue frame. In the first view the board lies flat on the middle of the "
    "phantom; then show it in the whole field, tilted up to 45°.",
    "robot": "Where the tissue frame is for the robot. Put one bead on the gripper where both cameras see it, and "
    "cover what else moves. The gripper moves by 8 mm and turns by 20° about its grasp.",
    "force": "The weight of the tool and the sensor's offset. Nothing may be held: the gripper tilts by 20° to all "
    "sides in free air.",
    "time": "How late force and images are stamped against the robot's pose. The gripper holds the phantom and sways "
    "by 2.5 mm, or taps by 1 mm.",
    "tool": f"Where the gripper's centre is in the tool. Touch one fixed point with it {FEWEST_TOUCHES} times or more, "
    f"turned by {LEAST_TURN_DEG:g}° and more in different directions; jog the robot by its pendant.",
}


class CalibratePage(QWidget):
    """Left the kinds that are made of the rig, and what is in force of each; right the wizard of the chosen one."""

    title = "Calibrate"

    def __init__(self, context: Context, laboratory: Laboratory, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._context, self._laboratory = context, laboratory
        self._offered = kinds_of(context.rig)
        self._mount_next = ""
        self._serials: dict[str, str] = {}
        self.wizard = CalibrationWizard(context, laboratory, self)
        self.kinds = QListWidget()
        self._hint, self._told = label(""), label("", "muted")
        self.mount_button = button(
            "Mount what it needs", tip="Starts the emulated laboratory anew with what this calibration needs."
        )
        self.motion = QComboBox()
        self.motion.setAccessibleName("motion of the calibration")
        self.record_button = button("Record the motion", "primary", "The robot moves, under the guard.")
        self.take_button = button("Take", "primary")
        self.finish_button = button("Calibrate")
        self._board_form = _board_form()
        self._board_card = Card("Board, as measured on the print")
        self._preview = CameraPreview([camera.name for camera in context.rig.cameras])
        self._maps = tuple(CoverageMap(name) for name in _who_sees_board(context.rig))
        self._view_card = Card("Views")
        self._views = BesideOrBelow(self._board_card, self._view_card, (0, 1))
        self.outcome = OutcomePanel()
        self._lay_out()
        self._wire()
        self.choose(self._offered[0])
        self._show_state(context.link.state)

    @property
    def kind(self) -> Kind:
        """What is chosen."""
        return self._offered[self.kinds.currentRow()]

    def choose(self, kind: Kind) -> None:
        """Choose a kind that is offered."""
        self.kinds.setCurrentRow(self._offered.index(kind))

    # ---- layout

    def _lay_out(self) -> None:
        for kind in self._offered:
            self.kinds.addItem(QListWidgetItem(kind))
        self.kinds.setAccessibleName("kinds of calibration")
        self.kinds.setProperty("role", "choices")
        self.kinds.setMaximumWidth(240)
        self.kinds.setWordWrap(True)
        page = QWidget()
        column = QVBoxLayout(page)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(12)
        steps = Card()
        steps.body.addWidget(self._hint)
        row = QHBoxLayout()
        for made in (
            self.mount_button,
            self.motion,
            self.record_button,
            self.take_button,
            self.finish_button,
        ):
            row.addWidget(made)
        row.addStretch(1)
        steps.body.addLayout(row)
        steps.body.addWidget(self._told)
        self._board_card.body.addWidget(self._board_form)
        self._board_card.body.addStretch(1)
        maps = QHBoxLayout()
        for shown in self._maps:
            maps.addWidget(shown)
        self._preview.setMinimumHeight(220)
        self._view_card.body.addWidget(self._preview, stretch=1)
        self._view_card.body.addLayout(maps)
        column.addWidget(steps)
        column.addWidget(self._views)
        column.addWidget(self.outcome)
        column.addStretch(1)
        both = QHBoxLayout()
        both.setSpacing(12)
        both.addWidget(self.kinds)
        self._area = scrolled(page)
        both.addWidget(self._area, stretch=1)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(20, 16, 20, 16)
        outer.setSpacing(12)
        outer.addWidget(label("Calibrate", "title"))
        outer.addLayout(both, stretch=1)

    def _wire(self) -> None:
        link, wizard = self._context.link, self.wizard
        self.kinds.currentRowChanged.connect(lambda _: self._show_kind())
        link.state_changed.connect(self._show_state)
        link.telemetry.connect(self._show_telemetry)
        link.opened.connect(self._on_opened)
        link.closed.connect(self._on_closed)
        self.mount_button.clicked.connect(self._mount)
        self.record_button.clicked.connect(self._record)
        self.take_button.clicked.connect(self._take)
        self.finish_button.clicked.connect(wizard.finish)
        wizard.told.connect(self._told.setText)
        wizard.view_taken.connect(self._show_view)
        wizard.touch_taken.connect(self._show_touch)
        wizard.judged.connect(self._show_outcome)
        wizard.kept.connect(self._on_kept)
        self.outcome.judged.connect(wizard.keep)
        self._board_form.changed.connect(self._begin)

    # ---- what the operator does

    def _mount(self) -> None:
        self._mount_next = self.kind if self.kind in MOTIONS else STANDARD
        self._told.setText("the emulated laboratory starts anew, some seconds")
        self._context.link.close()

    def _on_closed(self) -> None:
        if self._mount_next:
            mounted, self._mount_next = self._mount_next, ""
            self._laboratory.prepare(self._laboratory.emulated, mounted)

    def _record(self) -> None:
        self.outcome.hide()
        self.wizard.record_motion(self.kind, self.motion.currentText())

    def _take(self) -> None:
        if self.kind in SEEN_BY:
            self.wizard.take_view()
        else:
            self.wizard.take_touch()

    def _begin(self) -> None:
        """Begin to collect anew."""
        try:
            board = CharucoBoard(**self._board_form.values())
        except ValueError as error:
            self._told.setText(str(error))
            return
        if self.kind not in MOTIONS:
            self.wizard.begin(self.kind, board)
        for shown in self._maps:
            shown.clear()

    # ---- what is shown

    def _show_kind(self) -> None:
        kind = self.kind
        by_motion, by_board = kind in MOTIONS, kind in SEEN_BY
        self._hint.setText(_hint(kind, self._context.link.rig))
        self._told.setText("")
        self.motion.clear()
        self.motion.addItems(MOTIONS.get(kind, ()))
        self.motion.setVisible(by_motion and self.motion.count() > 1)
        self.record_button.setVisible(by_motion)
        self.take_button.setVisible(not by_motion)
        self.finish_button.setVisible(not by_motion)
        self.take_button.setText("Take this view" if by_board else "Take this touch")
        self._views.setVisible(by_board)
        self.outcome.hide()
        if self._context.link.state.connected:
            self._begin()
        self._show_state(self._context.link.state)

    def _show_state(self, state: RigState) -> None:
        ready = state.phase == "ready"
        for made in (self.record_button, self.take_button, self.finish_button, self.mount_button):
            made.setEnabled(ready)
        self.mount_button.setVisible(bool(self._laboratory.emulated) or self._laboratory.own is None)
        if state.session is not None and self.isVisible():
            self._told.setText(state.words)

    def _show_telemetry(self, seen: Telemetry) -> None:
        if self.isVisible() and self.kind in SEEN_BY:
            self._preview.show_images(seen.images)

    def _on_opened(self, devices: dict[str, DeviceIdentity]) -> None:
        self._serials = {role: identity.serial for role, identity in devices.items()}
        # an emulated camera brings what the rig file lacks
        self._hint.setText(_hint(self.kind, self._context.link.rig))
        self._show_in_force()
        self._begin()

    def _show_in_force(self) -> None:
        try:
            found = calibrations_in_force(self._context.link.rig, self._serials)
        except DaqError as error:
            self._told.setText(str(error))
            return
        for row, kind in enumerate(self._offered):
            record = found.records.get(kind)
            told = "as the rig file says" if record is None else f"until {record.expires[:10]}"
            self.kinds.item(row).setText(f"{kind}\n{told}")
        if found.warnings:
            self._context.navigator.tell(information(" ".join(found.warnings)))

    def _show_view(self, taken: ViewTaken) -> None:
        for shown, counts in zip(self._maps, taken.coverage, strict=True):
            shown.show_counts(counts)

    def _show_touch(self, taken: TouchTaken) -> None:
        figures = taken.figures
        off = "" if math.isnan(figures.rms_m) else f", off one point by {1e3 * figures.rms_m:.3f} mm rms"
        self._told.setText(f"{figures.touches} touches, turned by {figures.turn_deg:.0f}°{off}")

    def _show_outcome(self, outcome: Judged) -> None:
        self.outcome.show_outcome(outcome)
        # after the layout has made room for it
        QTimer.singleShot(0, self._show_verdict)

    def _show_verdict(self) -> None:
        self._area.ensureWidgetVisible(self.outcome.accept, 0, 400)

    def _on_kept(self, kept: Kept) -> None:
        verdict = "accepted" if kept.accepted else "rejected"
        self.outcome.show_kept(f"{verdict}, kept in {kept.path.name}")
        self._show_in_force()
        self._context.navigator.tell(
            information(f"The calibration {kept.kind} is {verdict} and kept in {kept.path}.")
        )


def _who_sees_board(rig: Rig) -> tuple[str, ...]:
    """Return what the images are called that the board is seen in."""
    return SIDES if len(rig.cameras) > 1 else (rig.cameras[0].name,)


def _hint(kind: Kind, rig: Rig) -> str:
    """Return what to do for a kind of calibration."""
    unused = why_unused(kind, rig)
    return f"{_HINTS[kind]} It will not be in force: {unused}." if unused else _HINTS[kind]


def _board_form() -> ParameterForm:
    board = CharucoBoard()
    usual = {name: getattr(board, name) for name in ("columns", "rows", "square_m", "marker_m")}
    ranges = {"columns": (3, 40), "rows": (3, 40), "square_m": (1e-3, 0.1), "marker_m": (5e-4, 0.1)}
    return ParameterForm(CharucoBoard, usual, ranges)
