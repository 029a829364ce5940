"""The Rig page: who is there and how well, connecting, run-up checks, and the zero of the force sensor."""

from dataclasses import replace

from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QLineEdit, QVBoxLayout, QWidget

from daq.acquisition.failures import Failure
from daq.device_checks import DeviceReport
from daq.rig import Rig
from gui.context import Context
from gui.messages import Message, failure_told, information
from gui.rig.check import check_rig
from gui.rig.laboratory import ROBOT, Laboratory, roles
from gui.rig.state import RigState
from gui.widgets.cards import Card, button, label, scrolled
from gui.widgets.lamp import Lamp
from gui.widgets.rig.device_table import DeviceTable
from gui.widgets.rig.readings import PoseReadings, WrenchReadings
from gui.widgets.split import BesideOrBelow
from robot_drivers.ati.compensation.tare import TareStack


class RigPage(QWidget):
    """Renders the link's state; its buttons ask the laboratory, the link and a job."""

    title = "Rig"

    def __init__(self, context: Context, laboratory: Laboratory, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._context, self._laboratory = context, laboratory
        self._check_when_closed = self._reconnect = False
        self.devices = DeviceTable(roles(context.rig), laboratory.own is not None)
        self.devices.set_emulated(laboratory.emulated)
        self.connect_button = button("Connect", "primary", "Connects all devices. Nothing moves.")
        self.disconnect_button = button(
            "Disconnect", tip="Holds a robot that moves, and lets go of the devices."
        )
        self.check_button = button("Run-up checks", tip="Looks at every device by itself. Nothing moves.")
        self.tare_button = button(
            "Tare", tip="Takes the mean of the last second for zero. What is recorded stays raw."
        )
        self.undo_button = button("Undo", tip="Goes back to the zero before.")
        self.home_button = button(
            "Jog to the grasp", tip="The emulated person jogs the emulated robot back by its pendant."
        )
        self.specimen = QLineEdit(context.rig.specimen.phantom_id)
        self.specimen.setAccessibleName("specimen")
        self.specimen.setToolTip(
            "The same for all experiments on one mounting; taken when the devices are connected."
        )
        self._told = label("", "muted")
        self._zero = label("", "muted")
        self._wrench, self._pose = WrenchReadings(), PoseReadings()
        self._checks = _ChecksCard()
        self._lay_out()
        self._wire()
        self._show_state(context.link.state)
        self._show_tares(context.link.tares)

    def _lay_out(self) -> None:
        devices = Card("Devices")
        devices.body.addWidget(self.devices)
        row = QHBoxLayout()
        for made in (self.connect_button, self.disconnect_button, self.check_button):
            row.addWidget(made)
        row.addWidget(self._told, stretch=1)
        row.addWidget(QLabel("specimen"))
        row.addWidget(self.specimen)
        devices.body.addLayout(row)
        force = Card("Force and torque, sensor frame")
        force.body.addWidget(self._wrench)
        row = QHBoxLayout()
        row.addWidget(self.tare_button)
        row.addWidget(self.undo_button)
        row.addWidget(self._zero, stretch=1)
        force.body.addLayout(row)
        pose = Card("Gripper from its grasp, tissue frame")
        pose.body.addWidget(self._pose)
        row = QHBoxLayout()
        row.addWidget(self.home_button)
        row.addStretch(1)
        pose.body.addLayout(row)
        pose.body.addStretch(1)
        page = QWidget()
        column = QVBoxLayout(page)
        column.setContentsMargins(20, 16, 20, 16)
        column.setSpacing(12)
        column.addWidget(label("Rig", "title"))
        column.addWidget(label(_rig_in_words(self._context.rig), "muted"))
        column.addWidget(devices)
        column.addWidget(BesideOrBelow(force, pose, (1, 1)))
        column.addWidget(self._checks)
        column.addStretch(1)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(scrolled(page))

    def _wire(self) -> None:
        link, laboratory = self._context.link, self._laboratory
        link.state_changed.connect(self._show_state)
        link.tare_changed.connect(self._show_tares)
        link.failed.connect(self._on_failed)
        link.closed.connect(self._on_closed)
        laboratory.prepared.connect(self._on_prepared)
        laboratory.failed.connect(self._on_laboratory_failed)
        self.connect_button.clicked.connect(self.connect_rig)
        self.disconnect_button.clicked.connect(link.close)
        self.check_button.clicked.connect(self._check)
        self.tare_button.clicked.connect(link.take_tare)
        self.undo_button.clicked.connect(link.undo_tare)
        self.home_button.clicked.connect(lambda: laboratory.help("home"))

    def connect_rig(self) -> None:
        """Connect the devices as they are chosen."""
        self._prepare()

    def _check(self) -> None:
        """Check the devices; those that are connected are let go for it, and connected again."""
        self._check_when_closed = True
        if self._context.link.state.connected:
            self._reconnect = True
            self._context.link.close()
        else:
            self._prepare()

    def _prepare(self) -> None:
        self.connect_button.setEnabled(False)
        self.check_button.setEnabled(False)
        emulated = self.devices.emulated
        self._told.setText("starting the emulated devices, some seconds" if emulated else "connecting")
        self._laboratory.prepare(emulated)

    def _on_prepared(self, rig: Rig) -> None:
        if not self._check_when_closed:
            mounted = replace(
                rig.specimen, phantom_id=self.specimen.text().strip() or rig.specimen.phantom_id
            )
            self._context.link.open(replace(rig, specimen=mounted))
            return
        self._check_when_closed = False
        self._told.setText("checking, nothing moves")
        job = self._context.jobs.start("run-up checks", check_rig, rig)
        job.finished.connect(self._checks.show_reports)
        job.failed.connect(lambda why: self._tell(Message("error", "The checks could not be made.", do=why)))
        job.ended.connect(self._on_checked)

    def _on_checked(self) -> None:
        self._show_state(self._context.link.state)
        if self._reconnect:
            self._reconnect = False
            self._prepare()

    def _on_closed(self) -> None:
        if self._check_when_closed:
            self._prepare()

    def _on_failed(self, failure: Failure) -> None:
        self._check_when_closed = self._reconnect = False
        self._tell(failure_told(failure))

    def _on_laboratory_failed(self, why: str) -> None:
        self._show_state(self._context.link.state)
        self._tell(
            Message("error", "The emulated laboratory could not be started.", "Nothing is connected.", why)
        )

    def _tell(self, message: Message) -> None:
        self._context.navigator.tell(message)

    def _show_state(self, state: RigState) -> None:
        self.devices.show_state(state)
        self._wrench.show_state(state)
        self._pose.show_state(state, self._context.link.rig)
        idle = state.phase in ("ready", "held")
        self.connect_button.setEnabled(state.phase == "disconnected")
        self.disconnect_button.setEnabled(idle)
        self.check_button.setEnabled(idle or state.phase == "disconnected")
        self.tare_button.setEnabled(state.connected)
        self.undo_button.setEnabled(state.connected and bool(self._context.link.tares.tares))
        self.specimen.setEnabled(state.phase == "disconnected")
        self.home_button.setEnabled(idle)
        self.home_button.setVisible(ROBOT in self.devices.emulated)
        self._told.setText("" if state.connected else state.words)

    def _show_tares(self, tares: TareStack) -> None:
        self.undo_button.setEnabled(bool(tares.tares))
        if not tares.tares:
            self._zero.setText("no tare: readings as the sensor sends them")
            self._zero.setToolTip("")
            return
        tare = tares.tares[-1]
        self._zero.setText(
            f"tare {len(tares.tares)}, {tare.samples} samples in {tare.duration_s:.1f} s; noise "
            f"{tare.noise_std[:3].max():.3f} N, {tare.noise_std[3:].max():.4f} N·m"
        )
        self._zero.setToolTip(tare.statement())
        self._tell(information("The force sensor is zeroed; what is recorded stays raw."))


class _ChecksCard(Card):
    """What the run-up checks say: a line each, failed ones first."""

    def __init__(self) -> None:
        super().__init__("Run-up checks")
        self._grid = QGridLayout()
        self._grid.setColumnStretch(3, 1)
        self._grid.setHorizontalSpacing(12)
        self.body.addLayout(self._grid)
        self.hide()

    def show_reports(self, reports: list[DeviceReport]) -> None:
        """Show them."""
        while (item := self._grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.deleteLater()
        lines = [(report, check) for report in reports for check in report.checks]
        for row, (report, check) in enumerate(sorted(lines, key=lambda line: line[1].passed)):
            lamp = Lamp()
            lamp.show_health("good" if check.passed else "bad")
            self._grid.addWidget(lamp, row, 0)
            self._grid.addWidget(QLabel(report.role), row, 1)
            self._grid.addWidget(QLabel(check.name), row, 2)
            self._grid.addWidget(label(check.told, "" if check.passed else "bad"), row, 3)
        self.show()


def _cameras_in_words(rig: Rig) -> str:
    if len(rig.cameras) > 2:
        return f"{len(rig.cameras)} cameras, the first two a stereo pair"
    if len(rig.cameras) == 2:
        return "two cameras, a stereo pair"
    if rig.depth_view is not None:
        return "one depth camera, which measures beads in space"
    if rig.planar_view is None:
        return "one camera, which measures no beads: the rig file has no [planar_view]"
    return "one camera, which measures beads in two dimensions"


def _rig_in_words(rig: Rig) -> str:
    size = " × ".join(f"{1e3 * edge:g}" for edge in rig.specimen.phantom.size_m)
    limits = rig.limits
    return (
        f"{rig.name}; specimen {rig.specimen.phantom_id}, {size} mm, {len(rig.specimen.fiducials_m)} beads; "
        f"{_cameras_in_words(rig)}; limits {limits.force_n:g} N, {limits.torque_nm:g} N·m, "
        f"{1e3 * limits.speed_m_s:g} mm/s"
    )
