"""The window's link to the acquisition process: commands go out, reports come in, and nothing here waits.

The client belongs to a thread of its own. The interface thread gives it a beat, thirty times a second; only a new
beat is passed on as a sign of life. So a frozen window is a silent client, and the acquisition process holds the
robot, although this program's other threads go on.
"""

from pathlib import Path

from PySide6.QtCore import QObject, QThread, QTimer, Signal, Slot

from daq.acquisition.failures import failure_of
from daq.acquisition.messages import (
    Check,
    Checked,
    Close,
    Ended,
    Hold,
    Look,
    Mark,
    Note,
    Open,
    Refused,
    Release,
    Seen,
    Start,
    TakeTare,
    Tared,
)
from daq.acquisition.viewing.channels import Analysis
from daq.rig import Rig
from daq.session.session import Label
from daq.trajectories import Trajectory
from gui.rig import state as states
from gui.rig.link_thread import Exchange, Worker
from gui.rig.state import RigState
from robot_drivers.ati.compensation.tare import TareRefusedError, TareStack

_BEAT_MS = 33
_SHOW_NS = 125_000_000


class AcquisitionLink(QObject):
    """One acquisition process at a time, or none; lives in the interface thread.

    Signals
    -------
    opened : the devices are connected; Mapping of their identities by role
    telemetry : Telemetry, in step with the cameras, otherwise thirty times a second
    state_changed : RigState, after every event, and eight times a second with new numbers
    ended : Ended, a session has ended
    checked : Checked, whether a trajectory may be carried out
    tare_changed : TareStack
    seen : Seen, images of one moment of both cameras, or of the only one
    refused : Failure, a command was not carried out
    failed : Failure, the devices could not be connected or the process is gone
    closed : the devices have been let go and all recordings sealed
    """

    opened = Signal(object)
    telemetry = Signal(object)
    state_changed = Signal(object)
    ended = Signal(object)
    checked = Signal(object)
    tare_changed = Signal(object)
    seen = Signal(object)
    refused = Signal(object)
    failed = Signal(object)
    closed = Signal()
    _commanded = Signal(object)
    _ending = Signal()

    def __init__(self, rig: Rig, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.rig = rig
        self.tares = TareStack()
        self.state = states.disconnected(rig)
        self._shown_ns = 0
        self._exchange = Exchange()
        self._thread = QThread()
        self._thread.setObjectName("acquisition link")
        self._worker = Worker(self._exchange)
        self._worker.moveToThread(self._thread)
        self._commanded.connect(self._worker.obey)
        self._ending.connect(self._worker.end)
        self._worker.opened.connect(self._on_opened)
        self._worker.reported.connect(self._on_report)
        self._worker.arrived.connect(self._on_arrived)
        self._worker.failed.connect(self._on_failed)
        self._worker.closed.connect(self._on_closed)
        self._thread.start()
        self._beat = QTimer(self, interval=_BEAT_MS)
        self._beat.timeout.connect(self._exchange.beat)
        self._beat.start()

    def open(self, rig: Rig) -> None:
        """Connect the devices of a rig; ``opened`` or ``failed`` follows. Nothing moves."""
        self.rig = rig
        self._change(states.connecting(rig))
        self._commanded.emit(Open(rig))

    def start(self, trajectory: Trajectory, folder: Path, label: Label) -> None:
        """Begin a session; ``ended`` follows."""
        self._commanded.emit(Start(trajectory, folder.absolute(), label))

    def check(self, trajectory: Trajectory) -> None:
        """Check a trajectory from where the robot stands; ``checked`` or ``refused`` follows."""
        self._commanded.emit(Check(trajectory))

    def hold(self, reason: str) -> None:
        """Software stop: hold the robot at once; a session under way ends."""
        self._commanded.emit(Hold(reason))

    def mark(self, problem: str) -> None:
        """Mark the session under way, if there is one, with a problem; the operator is told."""
        self._commanded.emit(Mark(problem))

    def release(self) -> None:
        """Let a robot that was held move again. Nothing moves by itself."""
        self._commanded.emit(Release())

    def note(self, text: str) -> None:
        """Record what the operator has to say."""
        self._commanded.emit(Note(text))

    def show(self, analysis: Analysis) -> None:
        """Show those who look on from elsewhere what was made of the measurements."""
        self._commanded.emit(analysis)

    def look(self) -> None:
        """Ask for the next full images of one moment, of both cameras or the only one; ``seen`` follows."""
        self._commanded.emit(Look())

    def take_tare(self) -> None:
        """Take the last second of the force sensor for zero; ``tare_changed`` or ``refused`` follows."""
        self._commanded.emit(TakeTare())

    def undo_tare(self) -> None:
        """Go back to the zero before; ``tare_changed`` or ``refused`` follows."""
        try:
            self._set_tares(self.tares.undo())
        except TareRefusedError as error:
            self.refused.emit(failure_of(error))

    def close(self) -> None:
        """Hold a robot that moves, seal what is recorded, let go of the devices; ``closed`` follows."""
        self._change(states.closing(self.state))
        self._commanded.emit(Close())

    def end(self) -> None:
        """End the thread, after :meth:`close`; waits for whatever is still to be sealed."""
        self._beat.stop()
        self._ending.emit()
        self._thread.wait()

    @Slot()
    def _on_arrived(self) -> None:
        seen = self._exchange.take()
        if seen is None or not self.state.connected:
            return
        before, self.state = self.state, states.told(self.state, seen, self.tares)
        if self.state.differs(before) or seen.time_ns - self._shown_ns >= _SHOW_NS:
            self._shown_ns = seen.time_ns
            self.state_changed.emit(self.state)
        self.telemetry.emit(seen)

    @Slot(object)
    def _on_opened(self, devices: object) -> None:
        self._set_tares(TareStack())
        assert isinstance(devices, dict)
        self._change(states.opened(self.state, devices))
        self.opened.emit(devices)

    @Slot(object)
    def _on_report(self, report: object) -> None:
        match report:
            case Ended():
                self.ended.emit(report)
            case Checked():
                self.checked.emit(report)
            case Tared(tare):
                self._set_tares(self.tares.push(tare))
            case Seen():
                self.seen.emit(report)
            case Refused(failure):
                self.refused.emit(failure)

    @Slot(object)
    def _on_failed(self, failure: object) -> None:
        self._change(states.disconnected(self.rig, "not connected: the last connection failed"))
        self.failed.emit(failure)

    @Slot()
    def _on_closed(self) -> None:
        self._change(states.disconnected(self.rig))
        self.closed.emit()

    def _set_tares(self, tares: TareStack) -> None:
        self.tares = tares
        self.tare_changed.emit(tares)

    def _change(self, state: RigState) -> None:
        self.state = state
        self.state_changed.emit(state)
