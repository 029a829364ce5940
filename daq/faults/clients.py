"""Who controls a session of the campaign: a client in this process, or ``retract record`` in one of its own."""

import itertools
import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from daq.acquisition.client import Acquisition
from daq.acquisition.messages import Ended
from daq.errors import DaqError, SessionError
from daq.faults.bench import Bench
from daq.lifeline import with_lifeline
from daq.progress import silent
from daq.recording.folder import INFO_FILE
from daq.recording.layout import CAMERAS_FILE
from daq.recording.running import RunningRecording
from daq.session.session import Label
from daq.trajectories import STANDARD_SPEED, Dwell, Retraction
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError

MOTION = Retraction(
    "pull",
    steps=3,
    step_length=0.003,
    axis=(1.0, 0.0, 0.0),
    angle=0.0,
    return_steps=0,
    speed=replace(STANDARD_SPEED, linear=0.006),
    dwell=Dwell(rest_s=0.4, settle_s=0.1, measure_s=0.2, holds_s=(1.2,)),
)
"""A retraction of four seconds, half of them in motion; its end is long enough to notice a silent device."""

NEXT = replace(MOTION, steps=1, dwell=Dwell(rest_s=0.3, settle_s=0.05, measure_s=0.1))

_POLL_S = 0.02
_BEGIN_TIMEOUT_S = 240.0  # of a program that starts on a machine with other work
_END_TIMEOUT_S = 120.0
_AGAIN_S = 0.5
_RELEASE_TIMEOUT_S = 3.0
_PATIENCE_S = 20.0


class Client(Protocol):
    """Controls sessions on one rig; belongs to one thread.

    Attributes
    ----------
    motion : what a session carries out
    """

    motion: Retraction

    def begin(self, folder: Path) -> int:
        """Begin a session, wait until samples are being written, and return since when, host clock, ns."""

    def attend(self, seconds: float) -> bool:
        """Watch for so long; return whether the session has ended meanwhile."""

    def acknowledged(self) -> dict[str, int]:
        """Return the samples of each stream that were said to be written, or seen in the files from outside."""

    def wait_for_end(self) -> str:
        """Wait for the end of the session and return what was told of a failure, as it was told; "" without one."""

    def next_session(self, folder: Path) -> str:
        """Let the robot move again and carry out another, shorter session; return why it failed, "" if it did not."""

    def close(self) -> None:
        """End what was started."""


class WindowClient:
    """A client of the acquisition process in this program, as the operator's window is one."""

    motion = MOTION

    def __init__(self, bench: Bench) -> None:
        self._rig = bench.rig
        self._acquisition = Acquisition(bench.rig)
        self._folder: Path | None = None
        self._acknowledged: dict[str, int] = {}
        self._told: str | None = None
        self._alive = True

    @property
    def recorder_id(self) -> int:
        """The process that records."""
        return self._acquisition.process_id

    def begin(self, folder: Path) -> int:
        """Begin a session, wait until samples of all streams are acknowledged, and return when that was."""
        self._folder, self._told, self._acknowledged = folder, None, {}
        self._release()
        self._acquisition.start(self.motion.trajectory(), folder, Label(folder.name))
        deadline = time.monotonic() + _BEGIN_TIMEOUT_S
        while not self.attend(_POLL_S) and time.monotonic() < deadline:
            if self._acknowledged and all(self._acknowledged.values()):
                return host_time_ns()
        raise SessionError(f"the session of the campaign did not begin: {self._told or 'nothing is written'}")

    def attend(self, seconds: float) -> bool:
        """Show that somebody watches, keep what is acknowledged, and note the end."""
        deadline = time.monotonic() + seconds
        while self._told is None:
            self._look(min(_POLL_S, max(0.0, deadline - time.monotonic())))
            if time.monotonic() >= deadline:
                break
        return self._told is not None

    def acknowledged(self) -> dict[str, int]:
        """Return what the telemetry told last."""
        return dict(self._acknowledged)

    def wait_for_end(self) -> str:
        """Return the failure that ended the session."""
        if not self.attend(_END_TIMEOUT_S):
            raise SessionError(f"the session of the campaign has not ended in {_END_TIMEOUT_S:g} s")
        return self._told or ""

    def next_session(self, folder: Path) -> str:
        """Release and begin, as an operator does who tries again for a while when refused."""
        deadline = time.monotonic() + _PATIENCE_S
        for number in itertools.count(1):
            attempt = folder.with_name(f"{folder.name}_{number}")
            try:
                return self._attempt(attempt)
            except (DaqError, DeviceError) as error:
                if attempt.exists() or not self._alive:
                    return str(error)
                if time.monotonic() > deadline:
                    return f"not begun in {number} attempts: {error}"
            time.sleep(_AGAIN_S)
        raise AssertionError("counting ends never")

    def close(self) -> None:
        """End the acquisition process."""
        self._acquisition.close()

    def _attempt(self, folder: Path) -> str:
        """Return what a session that was carried out bears; raises what ended it, or kept it from beginning."""
        if not self._alive:
            # what a window does when its operator presses "connect": nothing else is begun anew
            self._acquisition.close()
            self._acquisition, self._alive = Acquisition(self._rig), True
        self._release()
        info = self._acquisition.record(NEXT.trajectory(), folder, Label(folder.name), silent)
        return "; ".join(info.problems)

    def _release(self) -> None:
        """Let the robot move again, and wait until it may; raises why not."""
        self._acquisition.release()
        deadline = time.monotonic() + _RELEASE_TIMEOUT_S
        while time.monotonic() < deadline:
            self._acquisition.poll(_POLL_S)
            seen = self._acquisition.telemetry
            if seen is not None and not seen.held:
                return
        raise SessionError("the robot is still held after its release")

    def _look(self, timeout_s: float) -> None:
        try:
            ended = self._acquisition.poll(timeout_s)
        except (SessionError, DeviceError) as error:
            self._told, self._alive = str(error), False
            return
        seen = self._acquisition.telemetry
        if seen is not None and seen.session is not None and seen.session == self._folder:
            for stream, counts in seen.counts.items():
                self._acknowledged[stream] = max(self._acknowledged.get(stream, 0), counts.written)
        if isinstance(ended, Ended):
            self._told = "" if ended.failure is None else ended.failure.message


class CommandClient:
    """``retract record`` as a program of its own, of which only the process and the files are known.

    What counts as acknowledged is what another reader of the running recording saw last.
    """

    # no option shortens the rest
    motion = replace(MOTION, dwell=replace(MOTION.dwell, rest_s=Dwell().rest_s))

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._process: subprocess.Popen[str] | None = None
        self._recording: RunningRecording | None = None
        self._folder = Path()

    def begin(self, folder: Path) -> int:
        """Begin a session, wait until samples are in the files, and return the stamp of the first."""
        self._folder, self._recording = folder, None
        self._process = subprocess.Popen(
            _record_command(self._bench.rig_path, self.motion, folder),
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        deadline = time.monotonic() + _BEGIN_TIMEOUT_S
        while time.monotonic() < deadline and self._process.poll() is None:
            time.sleep(_POLL_S)
            if (folder / CAMERAS_FILE).exists() and all(self._seen().values()) and self._recording:
                return int(self._recording.force.host_time_ns[0])
        self._process.kill()
        assert self._process.stderr is not None
        told = self._process.stderr.read()
        raise SessionError(f"`retract record` of the campaign has not begun: {told.strip()[-300:]}")

    def attend(self, seconds: float) -> bool:
        """Wait for so long."""
        assert self._process is not None
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def acknowledged(self) -> dict[str, int]:
        """Return the samples that are in the files now, for whoever reads them."""
        return self._seen()

    @property
    def window_id(self) -> int:
        """The program."""
        assert self._process is not None
        return self._process.pid

    def wait_for_end(self) -> str:
        """Wait until the folder is sealed; a program that is gone tells nothing, so the folder has to."""
        deadline = time.monotonic() + _END_TIMEOUT_S
        while time.monotonic() < deadline:
            content = json.loads((self._folder / INFO_FILE).read_text(encoding="utf-8"))
            if content["state"] != "recording":
                return "\n".join(content["problems"])
            time.sleep(_POLL_S)
        raise SessionError(f"the recording of the campaign was not sealed in {_END_TIMEOUT_S:g} s")

    def next_session(self, folder: Path) -> str:
        """Carry out another session by a program that is started now."""
        self.close()
        successor = WindowClient(self._bench)
        try:
            return successor.next_session(folder)
        finally:
            successor.close()

    def close(self) -> None:
        """End the program."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for stream in filter(None, (self._process.stdin, self._process.stderr)):
                stream.close()

    def _seen(self) -> dict[str, int]:
        if self._recording is None:
            self._recording = RunningRecording(self._folder)
        found = self._recording
        found.read_on()
        images = {f"camera/{name}": len(found.images(name)) for name in found.cameras}
        return {"force": len(found.force), "robot": len(found.robot), **images}


def _record_command(rig_path: Path, motion: Retraction, folder: Path) -> list[str]:
    """Return the command that records a retraction, as an operator would type it."""
    dwell = motion.dwell
    holds = [word for hold_s in dwell.holds_s for word in ("--hold", f"{hold_s:g}")]
    return [
        *with_lifeline("daq.cli", "record", str(rig_path), "--trajectory", motion.kind),
        *("--steps", str(motion.steps), "--step-length", f"{motion.step_length * 1e3:g}"),
        *("--return-steps", str(motion.return_steps), "--speed", f"{motion.speed.linear * 1e3:g}"),
        *("--settle", f"{dwell.settle_s:g}", "--measure", f"{dwell.measure_s:g}", *holds),
        *("--release", "--output", str(folder)),
    ]
