"""The client of the acquisition process, for a script or for a window."""

import os
import pickle
import queue
import subprocess
import sys
import threading
from pathlib import Path

from daq.acquisition.failures import error_of
from daq.acquisition.messages import (
    VERSION,
    Alive,
    Close,
    Command,
    Ended,
    Hold,
    Note,
    Open,
    Opened,
    Refused,
    Release,
    Report,
    Start,
    Telemetry,
)
from daq.acquisition.viewing.channels import Analysis
from daq.acquisition.viewing.server import LiveServer
from daq.errors import SessionError
from daq.progress import Progress
from daq.recording.folder import SessionInfo
from daq.rig import Rig
from daq.session.session import Label
from daq.trajectories import Trajectory
from robot_drivers.closing import ClosedAtExit

_END_TIMEOUT_S = 600.0
_POLL_S = 0.1
# glibc gives every thread a heap of its own, and what a session frees in one no other uses: over the first sessions a
# recorder of 21 threads grew by 10 MiB each. Two heaps serve all.
_HEAPS = {"MALLOC_ARENA_MAX": "2"}


class Acquisition(ClosedAtExit):
    """An acquisition process with its devices connected, from construction to :meth:`close`; a context manager.

    All methods belong to one thread, which calls :meth:`poll` at least twice a second while a session runs: that is
    how the process knows that somebody watches.

    Attributes
    ----------
    devices : who they are, by their roles
    telemetry : the newest, None before the first
    viewers : who look on, where the rig file lets them; None where it lets nobody

    Raises
    ------
    DeviceError
        A device cannot be connected.
    SessionError
        The process does not answer, or nobody can listen for viewers.
    """

    def __init__(self, rig: Rig) -> None:
        self.telemetry: Telemetry | None = None
        cameras = tuple(camera.name for camera in rig.cameras)
        self.viewers = None if rig.viewers is None else LiveServer(rig.viewers, cameras)
        # who is to be seen alive: a window's interface thread is its first
        self._watcher = threading.main_thread().native_id or threading.get_native_id()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "daq.acquisition"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**_HEAPS, **os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            start_new_session=sys.platform != "win32",
        )
        self._reports: queue.SimpleQueue[Report | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, name="acquisition-reader", daemon=True)
        self._reader.start()
        try:
            self.send(Open(rig))
            opened = self._opened()
            if not isinstance(opened, Opened) or opened.version != VERSION:
                raise SessionError(
                    f"the acquisition process does not speak version {VERSION}; install it anew"
                )
        except BaseException:
            self.close()
            raise
        self.devices = opened.devices

    @property
    def process_id(self) -> int:
        """Of the acquisition process."""
        return self._process.pid

    def poll(self, timeout_s: float = 0.0) -> Ended | None:
        """Show that somebody watches; return the end of the session once it has come, waiting so long for it.

        Raises
        ------
        DaqError, DeviceError
            A command was refused.
        SessionError
            The process has died.
        """
        self.show_alive()
        report = self.listen(timeout_s)
        if isinstance(report, Refused):
            raise error_of(report.failure)
        return report if isinstance(report, Ended) else None

    def show_alive(self) -> None:
        """Show that somebody watches."""
        self.send(Alive((self._watcher, threading.get_native_id())))

    def listen(self, timeout_s: float = 0.0) -> Report | None:
        """Return the next report but for telemetry, waiting so long for it, without showing that somebody watches.

        Raises
        ------
        SessionError
            The process has died.
        """
        try:
            report = self._reports.get(timeout=timeout_s) if timeout_s > 0 else self._reports.get_nowait()
        except queue.Empty:
            return None
        if report is None:
            raise SessionError(
                "the acquisition process has died; its messages are above, the robot stops by its own watchdog, and "
                "`retract recover` saves the recording"
            )
        return report

    def send(self, command: Command) -> None:
        """Send a command; what it is answered with comes from :meth:`listen`.

        Raises
        ------
        SessionError
            The process is gone.
        """
        assert self._process.stdin is not None
        try:
            pickle.dump(command, self._process.stdin)
            self._process.stdin.flush()
        except OSError as error:
            raise SessionError("the acquisition process is gone; its messages are above") from error

    def start(self, trajectory: Trajectory, folder: Path, label: Label) -> None:
        """Begin a session; its end comes from :meth:`poll`."""
        self.send(Start(trajectory, folder.absolute(), label))

    def hold(self, reason: str) -> None:
        """Hold the robot; a session under way ends."""
        self.send(Hold(reason))

    def release(self) -> None:
        """Let a robot that was held move again; look at the cell first."""
        self.send(Release())

    def note(self, text: str) -> None:
        """Record what the operator has to say."""
        self.send(Note(text))

    def record(self, trajectory: Trajectory, folder: Path, label: Label, progress: Progress) -> SessionInfo:
        """Carry out a session and wait for its end, as :func:`daq.session.session.run_session` does in one process.

        Raises
        ------
        DaqError, DeviceError
            As there: an error keeps its class on its way out of the process.
        KeyboardInterrupt
            The robot is held and the recording is sealed.
        """
        self.start(trajectory, folder, label)
        try:
            ended = self._watch(progress)
        except KeyboardInterrupt as interrupt:
            self.hold(str(interrupt) or "interrupted by the operator")
            self._watch(progress)
            raise
        if ended.failure is not None:
            raise error_of(ended.failure)
        if ended.info is None:
            raise SessionError(f"{folder}: the session has ended without a word; look at its files")
        return ended.info

    def show(self, analysis: Analysis) -> None:
        """Show those who look on what was made of the measurements; does nothing where nobody may."""
        if self.viewers is not None:
            self.viewers.tell(analysis)

    def close(self) -> None:
        """End the process; a session under way is held and sealed first."""
        assert self._process.stdin is not None
        try:
            self.send(Close())
            self._process.stdin.close()
        except (SessionError, OSError):
            pass  # it has ended already
        try:
            self._process.wait(_END_TIMEOUT_S)
        finally:
            self._reader.join(_END_TIMEOUT_S)
            if self._process.stdout is not None:
                self._process.stdout.close()
            if self.viewers is not None:
                self.viewers.close()

    def _watch(self, progress: Progress) -> Ended:
        while (ended := self.poll(_POLL_S)) is None:
            if (seen := self.telemetry) is not None and seen.session is not None:
                progress(seen.state, seen.step, seen.steps)
        return ended

    def _opened(self) -> Report:
        """Wait for the first report, as long as the process lives: its devices have time-outs of their own."""
        report = self._reports.get()
        if report is None:
            raise SessionError("the acquisition process has ended at its start; its messages are above")
        if isinstance(report, Refused):
            raise error_of(report.failure)
        return report

    def _read(self) -> None:
        """Pass on what the process reports; of the telemetry only the newest is kept."""
        assert self._process.stdout is not None
        try:
            while True:
                report = pickle.load(self._process.stdout)
                if isinstance(report, Telemetry):
                    self.telemetry = report
                    if self.viewers is not None:
                        self.viewers.tell(report)
                else:
                    self._reports.put(report)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            self._reports.put(None)
