"""One calibration at a time, from its beginning to its verdict: who is asked for what, and in which order.

The devices belong to the acquisition process, the computation to :class:`gui.calibration.bench.CalibrationBench`, and
at an emulated laboratory its own person holds the board and touches the point.
"""

from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from daq.acquisition.messages import Ended, Seen
from daq.calibration.procedures import MOTIONS, serials_of
from daq.calibration_files.outcome import Kind
from daq.session.session import Label
from daq.trajectories.routines import NAMED
from daq.vision.charuco import CharucoBoard
from gui.calibration import bench
from gui.calibration.bench import CalibrationBench, Judged, Kept, TouchTaken, ViewTaken
from gui.context import Context
from gui.jobs.companion import Companion
from gui.jobs.process import Failed
from gui.messages import Message, failure_told
from gui.rig.laboratory import Laboratory
from robot_drivers.protocols import DeviceIdentity, Pose

_SETTLE_MS = 1200
"""From the emulated person's holding still to an image that shows it."""

_NO_MORE = 10**6


class CalibrationWizard(QObject):
    """Collects, evaluates and keeps; ``told`` brings a line for the operator.

    Signals
    -------
    view_taken, touch_taken, judged, kept : answers of the bench
    recording : bool, whether the motion of a calibration is being recorded
    """

    told = Signal(str)
    view_taken = Signal(object)
    touch_taken = Signal(object)
    judged = Signal(object)
    kept = Signal(object)
    recording = Signal(bool)

    def __init__(self, context: Context, laboratory: Laboratory, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._context, self._laboratory = context, laboratory
        self._companion: Companion | None = None
        self._kind: Kind = "cameras"
        self._board = CharucoBoard()
        self._looking = False
        self._motion: Path | None = None
        self._taken = 0
        self._serials: dict[str, str] = {}
        context.link.opened.connect(self._on_opened)
        context.link.seen.connect(self._on_seen)
        context.link.ended.connect(self._on_ended)
        laboratory.helped.connect(self._on_helped)

    @property
    def folder(self) -> Path:
        """Where calibrations are kept."""
        folder = self._context.link.rig.calibration
        assert folder is not None  # the laboratory gives every rig one
        return folder

    def begin(self, kind: Kind, board: CharucoBoard) -> None:
        """Begin anew with a kind of calibration."""
        self._kind, self._board, self._taken = kind, board, 0
        self._ask(bench.Begin(self._context.link.rig, kind, board))

    def take_view(self) -> None:
        """Take the next images of one moment; an emulated person shows the board first."""
        if self._helped:
            self._laboratory.help("board", self._taken)
        else:
            self._look()

    def take_touch(self) -> None:
        """Take where the robot stands for a touch of the point; an emulated person jogs it there first."""
        if self._helped:
            self._laboratory.help("touch", self._taken)
        else:
            self._touch()

    def finish(self) -> None:
        """Calibrate from what was collected; an emulated person puts the board away or jogs the robot back."""
        if self._helped:
            self._laboratory.help("touch" if self._kind == "tool" else "board", _NO_MORE)
        self.told.emit("calculating")
        self._ask(bench.Finish())

    def record_motion(self, kind: Kind, motion: str) -> None:
        """Record the motion of a calibration under the guard, then evaluate it. The robot moves."""
        if motion not in MOTIONS[kind]:
            raise ValueError(f"{kind} is not calibrated by {motion!r}")
        self._kind = kind
        self._motion = self.folder / "sessions" / f"{motion}_{datetime.now().astimezone():%Y-%m-%d_%H%M%S}"
        self.recording.emit(True)
        self._context.link.start(NAMED[motion](), self._motion, Label(f"calibrate {kind}"))

    def keep(self, accepted: bool) -> None:
        """Keep the outcome with this verdict."""
        serials = serials_of(self._kind, self._serials)
        self._ask(bench.Keep(self.folder, self._context.link.rig.name, serials, accepted))

    def end(self) -> None:
        """End the process of the bench."""
        if self._companion is not None:
            self._companion.end()
            self._companion.deleteLater()
        self._companion = None

    @property
    def _helped(self) -> bool:
        return self._laboratory.helper is not None and bool(self._laboratory.emulated)

    def _ask(self, request: object) -> None:
        if self._companion is None:
            self._companion = Companion(CalibrationBench, (), self)
            self._companion.answered.connect(self._on_answer)
            self._companion.progressed.connect(self._on_progress)
            self._companion.gone.connect(self.end)
        self._companion.ask(request)

    def _look(self) -> None:
        self._looking = True
        self._context.link.look()

    def _touch(self) -> None:
        tool = self._context.link.state.tool
        if tool is None:
            self.told.emit("no pose of the robot has come yet")
            return
        x, y, z, qw, qx, qy, qz = tool.tolist()
        self._ask(bench.TakeTouch(Pose((x, y, z), (qw, qx, qy, qz))))

    def _on_helped(self, action: str, more: bool) -> None:
        if not more:
            self.told.emit(f"the emulated person is done, {self._taken} taken")
        elif action == "board":
            QTimer.singleShot(_SETTLE_MS, self._look)
        elif action == "touch":
            QTimer.singleShot(_SETTLE_MS, self._touch)

    def _on_opened(self, devices: dict[str, DeviceIdentity]) -> None:
        self._serials = {role: identity.serial for role, identity in devices.items()}

    def _on_seen(self, seen: Seen) -> None:
        if self._looking:
            self._looking = False
            self._ask(bench.TakeView(tuple(seen.images.values()), seen.pixel_format))

    def _on_ended(self, ended: Ended) -> None:
        session, self._motion = self._motion, None
        if session is None:
            return
        self.recording.emit(False)
        if ended.failure is not None:
            self._context.navigator.tell(failure_told(ended.failure))
        else:
            self.told.emit("evaluating the recording")
            self._ask(bench.Evaluate(self._kind, session))

    def _on_progress(self, text: str, done: int, total: int) -> None:
        self.told.emit(f"{text}, step {done} of at most {total}" if total > 1 else text)

    def _on_answer(self, answer: object) -> None:
        match answer:
            case ViewTaken():
                self._taken += not answer.figures.problem
                self.told.emit(answer.figures.describe())
                self.view_taken.emit(answer)
            case TouchTaken():
                self._taken += 1
                self.touch_taken.emit(answer)
            case Judged():
                verdict = "acceptable" if answer.acceptable else "to be rejected"
                self.told.emit("; ".join([verdict, *answer.notes]))
                self.judged.emit(answer)
            case Kept():
                self.kept.emit(answer)
                self._context.navigator.calibration_kept.emit(answer.path)
            case Failed(message):
                self.told.emit(message)
                self._context.navigator.tell(
                    Message("error", message, "Nothing is in force that was not before.")
                )
