"""Which rig is used: the one of the rig file, with any of its devices replaced by emulated ones.

The emulated laboratory is started when the first device needs it, in a thread that may wait, and ends with the window.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path
from typing import Literal, Protocol

from PySide6.QtCore import QObject, QThread, QTimer, Signal, Slot

from daq.errors import DaqError
from daq.rig import Rig, read_rig

FORCE_SENSOR, ROBOT = "force sensor", "robot"
STANDARD = "standard"
CALIBRATIONS_FOLDER = "calibration"
"""Beside the sessions: where the calibrations of a rig are that names no folder for them."""
Action = Literal["board", "touch", "home"]

_NO_MORE = 10**6
_NOTICES_MS = 300


class Helper(Protocol):
    """The person at the emulated laboratory; see :class:`daq.virtual_rig.operator.VirtualOperator`."""

    def show_board(self, number: int) -> bool:
        """Show the calibration board to the cameras."""

    def touch_point(self, number: int) -> bool:
        """Touch a fixed point with the gripper."""


class Running(Protocol):
    """An emulated laboratory that runs."""

    @property
    def rig_path(self) -> Path:
        """Its rig file."""

    @property
    def operator(self) -> Helper:
        """Who works at it."""

    def notices(self) -> list[str]:
        """Return what went wrong in it since the last call."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What the emulated laboratory is to be like.

    Attributes
    ----------
    mounted : ``STANDARD``, or for a kind of calibration
    beside_real_devices : whether its devices are used beside real ones, for which its time cannot wait
    cameras : 2 for a stereo pair, 1 for an only camera
    depth : whether that is a depth camera
    """

    mounted: str = STANDARD
    beside_real_devices: bool = False
    cameras: Literal[1, 2] = 2
    depth: bool = False


RunEmulators = Callable[[Wanted], AbstractContextManager[Running]]
"""Runs the emulated laboratory as long as the context lasts."""


class Laboratory(QObject):
    """Prepares the rig to be connected.

    Signals
    -------
    prepared : Rig, ready to be connected
    failed : str, the emulated laboratory could not be started, or its person cannot help
    helped : what its person has done, and False where there was no more to do
    warned : str, what went wrong in the emulated laboratory

    Parameters
    ----------
    own : the rig of the rig file; None where there is only the emulated one
    calibrations : folder of the calibrations of a rig that names none
    """

    prepared = Signal(object)
    failed = Signal(str)
    helped = Signal(str, bool)
    warned = Signal(str)
    _wanted = Signal(object)
    _help_wanted = Signal(str, int)
    _ending = Signal()

    def __init__(
        self, own: Rig | None, run_emulators: RunEmulators, calibrations: Path, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._calibrations = calibrations.absolute()
        self.own = None if own is None else self._with_calibrations(own)
        self.emulated: frozenset[str] = frozenset()
        self.helper: Helper | None = None
        self._thread = QThread()
        self._thread.setObjectName("laboratory")
        self._runner = _Runner(run_emulators)
        self._runner.moveToThread(self._thread)
        self._wanted.connect(self._runner.run)
        self._runner.running.connect(self._on_running)
        self._runner.failed.connect(self.failed)
        self._runner.helped.connect(self.helped)
        self._runner.warned.connect(self.warned)
        self._help_wanted.connect(self._runner.help)
        self._ending.connect(self._runner.end)
        self._thread.start()

    def prepare(self, emulated: frozenset[str], mounted: str = STANDARD) -> None:
        """Prepare the rig with these devices emulated, by their roles; ``prepared`` or ``failed`` follows."""
        self.emulated = emulated
        if emulated or self.own is None:
            self._wanted.emit(self._laboratory_for(mounted))
        else:
            self.prepared.emit(self.own)

    def help(self, action: Action, number: int = 0) -> None:
        """Have the emulated person show the board, touch the point, or jog the robot home; ``helped`` follows."""
        self._help_wanted.emit(action, number)

    def end(self) -> None:
        """End the emulated laboratory and the thread; waits for them."""
        self._ending.emit()
        self._thread.wait()

    def _laboratory_for(self, mounted: str) -> Wanted:
        if self.own is None:
            return Wanted(mounted)
        beside_real_devices = not self.emulated >= set(roles(self.own))
        only = len(self.own.cameras) == 1
        return Wanted(mounted, beside_real_devices, 1 if only else 2, self.own.depth_view is not None)

    def _with_calibrations(self, rig: Rig) -> Rig:
        return replace(rig, calibration=rig.calibration or self._calibrations)

    @Slot(object, object)
    def _on_running(self, found: Rig, helper: object) -> None:
        virtual = self._with_calibrations(found)
        self.helper = helper  # type: ignore[assignment] # signals know no protocols
        if self.own is None:
            self.emulated = frozenset(roles(virtual))
        self.prepared.emit(mixed(self.own, virtual, self.emulated))


def roles(rig: Rig) -> tuple[str, ...]:
    """Return the roles of a rig's devices."""
    return (FORCE_SENSOR, ROBOT, *(f"camera {camera.name}" for camera in rig.cameras))


def mixed(own: Rig | None, virtual: Rig, emulated: frozenset[str]) -> Rig:
    """Return a rig with some devices of the emulated laboratory, or all; its cameras are called as the real ones.

    An emulated robot stands in the emulated laboratory, so frames, tool, limits and specimen are those of the latter;
    emulated cameras bring their own calibration. The emulated laboratory has a stereo pair, or one camera, with depth
    or without, where the rig has one such: of further cameras those that are to be emulated are left out. The name
    tells what is emulated, so that no calibration of the real rig is taken for the mixed one.
    """
    if own is None:
        return virtual
    rig = virtual
    if not emulated >= set(roles(own)):
        rig = replace(own, name=f"{own.name} with emulated {', '.join(sorted(emulated))}")
    if FORCE_SENSOR in emulated:
        rig = replace(rig, force_sensor=virtual.force_sensor)
    if ROBOT in emulated:
        rig = replace(
            rig,
            robot=virtual.robot,
            frames=virtual.frames,
            tool=virtual.tool,
            limits=virtual.limits,
            specimen=virtual.specimen,
        )
    cameras = []
    for ours, theirs in zip_longest(own.cameras, virtual.cameras[: len(own.cameras)]):
        if f"camera {ours.name}" not in emulated:
            cameras.append(ours)
        elif theirs is not None:
            cameras.append(replace(theirs, name=ours.name))
    if any(f"camera {camera.name}" in emulated for camera in own.cameras[:2]):
        rig = replace(
            rig,
            stereo_calibration=virtual.stereo_calibration,
            planar_view=virtual.planar_view,
            depth_view=virtual.depth_view,
            vision=virtual.vision,
        )
    return replace(rig, cameras=tuple(cameras))


class _Runner(QObject):
    """Starts and ends the emulated laboratory; everything here happens in the laboratory's thread."""

    running = Signal(object, object)
    failed = Signal(str)
    helped = Signal(str, bool)
    warned = Signal(str)

    def __init__(self, run_emulators: RunEmulators) -> None:
        super().__init__()
        self._run_emulators = run_emulators
        self._stack = ExitStack()
        self._present: Wanted | None = None
        self._now: tuple[Rig, Helper] | None = None
        self._running: Running | None = None
        self._ear = QTimer(self, interval=_NOTICES_MS)
        self._ear.timeout.connect(self._listen)

    @Slot(object)
    def run(self, wanted: Wanted) -> None:
        """Run the laboratory that is wanted."""
        if wanted != self._present or self._now is None:
            self._ear.stop()
            self._stack.close()
            self._stack, self._now, self._running = ExitStack(), None, None
            if not self._started(wanted):
                return
            self._ear.start()
        if self._now is not None:
            self.running.emit(*self._now)

    @Slot()
    def end(self) -> None:
        """End the laboratory and the thread."""
        self._ear.stop()
        self._stack.close()
        self.thread().quit()

    @Slot(str, int)
    def help(self, action: str, number: int) -> None:
        """Let the emulated person act."""
        if self._now is None:
            return
        _, helper = self._now
        try:
            # after the last touch the robot is jogged back to the grasp
            place = _NO_MORE if action == "home" else number
            more = helper.show_board(number) if action == "board" else helper.touch_point(place)
        except DaqError as error:
            self.failed.emit(str(error))
        else:
            self.helped.emit(action, more)

    @Slot()
    def _listen(self) -> None:
        if self._running is not None:
            for notice in self._running.notices():
                self.warned.emit(notice)

    def _started(self, wanted: Wanted) -> bool:
        try:
            running = self._stack.enter_context(self._run_emulators(wanted))
            self._running, self._present = running, wanted
            self._now = (read_rig(running.rig_path), running.operator)
        except (DaqError, OSError) as error:
            self.failed.emit(str(error))
            return False
        return True
