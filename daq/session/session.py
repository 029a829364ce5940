"""One retraction, from the check of its trajectory to the sealed folder.

Rest window, from which the guard takes its zero; for each step move, settle, measure. Events in the recording tell
the windows; nothing is averaged here. Whatever ends a session, the robot stands and the recording is sealed.
"""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Protocol

from daq.calibration.in_force import InForce, calibrations_in_force
from daq.devices import Devices
from daq.errors import RecordingError, SessionError
from daq.progress import Progress, silent
from daq.recording.folder import (
    CALIBRATION_FOLDER,
    RIG_FILE,
    SessionInfo,
    seal_session,
    sha256,
    write_info,
)
from daq.recording.in_use import locked
from daq.recording.reader import Recording
from daq.recording.recorder import Recorder
from daq.recording.streams import Observer
from daq.rig import Rig, write_rig
from daq.session.checks import check_limits, require_rest, tool_targets
from daq.session.guard import GUARD_LATENCY, PACE, Guard, Stop
from daq.session.steps import StepRunner
from daq.session_report import write_report
from daq.trajectories import Trajectory
from daq.versions import package_versions
from daq.vision.camera_model import PinholeCamera, StereoCalibration
from robot_drivers.clock import host_time_ns, monotonic_time_ns, wait_until
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import FloatArray, Pose, StreamStatistics

# what the tissue and the robot do once it was stopped belongs into the recording
_AFTER_STOP_NS = 500_000_000


@dataclass(frozen=True, slots=True)
class Label:
    """What the operator says about a session; ``order`` is 1 for the first experiment on a mounting."""

    name: str
    order: int = 1
    operator: str = ""
    notes: str = ""


@dataclass(frozen=True, slots=True)
class _Instant:
    """The host clock, and the computer's own, which runs on where an emulated laboratory waits; ns."""

    host_ns: int
    monotonic_ns: int

    @classmethod
    def now(cls) -> "_Instant":
        return cls(host_time_ns(), monotonic_time_ns())

    def slowdown_since(self) -> float:
        """Return how many times slower than the computer's the host clock has run since."""
        now = _Instant.now()
        return (now.monotonic_ns - self.monotonic_ns) / max(1, now.host_ns - self.host_ns)


class RecordSession(Protocol):
    """Carries out one session with devices that it knows, as :meth:`Session.run` does."""

    def __call__(
        self, trajectory: Trajectory, folder: Path, label: Label, progress: Progress, /
    ) -> SessionInfo:
        """Record one retraction into a new folder."""


@contextmanager
def connected(devices: Devices) -> Iterator[Devices]:
    """Connect all devices, and close them in the end. Nothing moves."""
    with ExitStack() as stack:
        for device in devices.all().values():
            stack.callback(device.close)
            device.connect()
        yield devices


def run_session(
    rig: Rig, devices: Devices, trajectory: Trajectory, folder: Path, label: Label, progress: Progress
) -> SessionInfo:
    """Record one retraction with connected devices, as :meth:`Session.run` does."""
    return Session(rig, devices, trajectory, folder, label).run(progress)


class Session:
    """One retraction with connected devices. While :meth:`run` carries it out, other threads may hold, note and look.

    Parameters
    ----------
    folder : of the session, must not exist
    observers : see what the devices bring, behind the guard
    """

    def __init__(
        self,
        rig: Rig,
        devices: Devices,
        trajectory: Trajectory,
        folder: Path,
        label: Label,
        observers: Sequence[Observer] = (),
    ) -> None:
        self.folder = folder
        self._marks: list[str] = []
        self._before: Mapping[str, StreamStatistics] = {}
        self._after: Mapping[str, StreamStatistics] | None = None
        serials = {role: device.identity.serial for role, device in devices.all().items()}
        self._in_force = calibrations_in_force(rig, serials)
        self._rig = rig = self._in_force.apply(rig)
        self._devices = devices
        self._trajectory = trajectory
        self._label = label
        self._observers = observers
        self._guard = Guard(rig.limits, rig.frames, devices.robot)
        self._recorder: Recorder | None = None

    def check(self) -> list[Pose]:
        """Return where the tool will stand at every step, ``T_base_tool``; nothing moves.

        Raises
        ------
        SessionError, MotionLimitError, MotionRefusedError
            The robot does not stand at the grasp, or a limit forbids a step; the message names step and axis.
        """
        state = self._devices.robot.state()
        require_rest(self._rig, state)
        targets = tool_targets(self._rig, self._trajectory, state.T_base_tool)
        check_limits(self._rig, self._trajectory, targets)
        self._devices.robot.check_trajectory(targets[1:], self._trajectory.speed)
        return targets

    def run(self, progress: Progress) -> SessionInfo:
        """Record the retraction; ``progress`` is called in this thread.

        Returns
        -------
        What the sealed folder says of itself.

        Raises
        ------
        SessionError, MotionLimitError, MotionRefusedError
            Before anything moved, and before there is a folder.
        SoftwareStopError
            The guard has held the robot; the recording is sealed.
        DeviceError, RecordingError
            A device or the disk failed; the robot is held, the recording is sealed as far as it goes.
        KeyboardInterrupt
            The same.
        """
        devices, trajectory = self._devices, self._trajectory
        targets = self.check()
        models = _camera_models(self._rig)
        devices.force_sensor.start()
        # what gathered while nobody read is not of this session, nor is what has been lost of it
        devices.robot.read(0.0)
        for camera in devices.cameras.values():
            camera.read(0.0)
        _make_folder(self._rig, self._in_force, devices, trajectory, self.folder, self._label)
        with locked(self.folder / RIG_FILE):
            return self._record(targets, models, progress)

    def _record(
        self, targets: Sequence[Pose], models: Mapping[str, PinholeCamera], progress: Progress
    ) -> SessionInfo:
        """Record into the folder, and seal it, however the retraction ends."""
        devices, trajectory = self._devices, self._trajectory
        self._before, began = _statistics(devices), _Instant.now()
        recorder = self._recorder = Recorder(
            self.folder,
            devices.force_sensor,
            devices.robot,
            devices.cameras,
            (self._guard, *self._observers),
            models,
            tell_failure=lambda failure: self._guard.hold(str(failure)),
        )
        problems: list[str] = []
        try:
            StepRunner(devices.robot, self._guard, recorder, progress).run(trajectory, targets)
        except BaseException as error:
            problems.append(self._hold_after(error, recorder))
            raise
        finally:
            problems += self._end(recorder, began)
            progress("checking and sealing the recording", len(targets), len(targets))
            info = self._seal(problems)
        return info

    @property
    def stop(self) -> Stop | None:
        """Why the robot was held, None while it was not; waits for a hold under way."""
        return self._guard.stop

    @property
    def zero(self) -> FloatArray | None:
        """What the guard takes for no load (6,), N and N·m, sensor frame; None before it guards."""
        return self._guard.zero

    def hold(self, reason: str) -> None:
        """Hold the robot, which ends the session; from any thread."""
        self._guard.hold(reason)

    def note(self, text: str) -> None:
        """Record what the operator has to say; from any thread.

        Raises
        ------
        SessionError
            Nothing is being recorded yet.
        """
        if self._recorder is None:
            raise SessionError("nothing is being recorded yet; note it again once the session runs")
        self._recorder.event("note", text=text)

    def mark(self, problem: str) -> None:
        """Mark the session with a problem that somebody else knows of; from any thread."""
        if problem not in self._marks:
            self._marks.append(problem)

    def problems(self) -> tuple[str, ...]:
        """Return a line for everything that an analyst must know, as far as it is known by now."""
        if self._recorder is None:
            return self._in_force.warnings
        try:
            losses = _losses(self._before, self._after or _statistics(self._devices))
        except DeviceError:
            losses = []  # a device that is lost is told as what ends the session
        return (*self._in_force.warnings, *losses, *_drops(self._recorder), *self._marks)

    def written(self) -> dict[str, int]:
        """Return the samples of each stream that are in the file."""
        return {} if self._recorder is None else self._recorder.written()

    def dropped(self) -> dict[str, int]:
        """Return the samples of each stream that were received but not written."""
        return {} if self._recorder is None else self._recorder.dropped()

    def _seal(self, problems: list[str]) -> SessionInfo:
        try:
            warnings = write_report(Recording(self.folder), silent).warnings
            return seal_session(self.folder, (*problems, *warnings))
        except OSError as error:
            raise RecordingError(
                f"{self.folder}: cannot be sealed ({error}), nothing that was written is lost; make room on the disk "
                "and run `retract recover`"
            ) from error

    def _hold_after(self, error: BaseException, recorder: Recorder) -> str:
        """Hold the robot after whatever went wrong, record it, and return what to write into the session."""
        reason = str(error) or "interrupted by the operator"
        self._guard.hold(reason)
        try:
            recorder.event(
                "session_failed", reason=reason, guard=None if self.stop is None else asdict(self.stop)
            )
        except RecordingError as failure:
            return f"{reason}; {failure}"
        wait_until(host_time_ns() + _AFTER_STOP_NS)
        return reason

    def _end(self, recorder: Recorder, began: "_Instant") -> list[str]:
        """Stop recording, and return a line for everything that an analyst must know."""
        latency, problems = self._guard.latency, []
        try:
            recorder.event(
                GUARD_LATENCY,
                blocks=latency.count,
                median_s=latency.quantile_s(0.5),
                most_s=latency.quantile_s(0.999),
                longest_s=latency.longest_s,
            )
            if self._rig.laboratory_clock is not None:
                recorder.event(PACE, slowdown=began.slowdown_since())
        except RecordingError as failure:
            problems.append(str(failure))
        try:
            recorder.close()
        except OSError as error:
            problems.append(f"the end of the recording may not have reached the disk ({error})")
        self._devices.force_sensor.stop()
        # while the recording is checked and sealed nobody reads, and what is lost then is not lost to it
        self._after = _statistics(self._devices)
        return [*self.problems(), *problems]


def _camera_models(rig: Rig) -> dict[str, PinholeCamera]:
    pair = StereoCalibration.load(rig.stereo_calibration)
    return {rig.cameras[0].name: pair.left, rig.cameras[1].name: pair.right}


def _make_folder(
    rig: Rig, in_force: InForce, devices: Devices, trajectory: Trajectory, folder: Path, label: Label
) -> None:
    """Make the session folder with its description and copies of what is in force."""
    calibration = folder / CALIBRATION_FOLDER / rig.stereo_calibration.name
    try:
        folder.mkdir(parents=True)
        calibration.parent.mkdir()
        shutil.copyfile(rig.stereo_calibration, calibration)
        copies = {calibration, *in_force.copy_to(calibration.parent)}
    except OSError as error:
        raise RecordingError(f"{folder}: no session can be put there ({error}); name a new folder") from error
    kept = replace(rig, stereo_calibration=calibration, calibration=calibration.parent, laboratory_clock=None)
    write_rig(kept, folder / RIG_FILE)
    info = SessionInfo(
        name=label.name,
        phantom_id=rig.specimen.phantom_id,
        order=label.order,
        operator=label.operator,
        notes=label.notes,
        trajectory=asdict(trajectory),
        versions=package_versions(),
        calibrations=in_force.describe(),
        devices={role: device.identity for role, device in devices.all().items()},
        checksums={
            path.relative_to(folder).as_posix(): sha256(path) for path in (folder / RIG_FILE, *sorted(copies))
        },
    )
    write_info(folder, info)


def _statistics(devices: Devices) -> dict[str, StreamStatistics]:
    return {role: device.statistics() for role, device in devices.all().items()}


def _losses(before: Mapping[str, StreamStatistics], after: Mapping[str, StreamStatistics]) -> list[str]:
    """Return a line for everything that befell the messages of a device meanwhile: they are counted from connecting."""
    told = []
    for role, count in after.items():
        words = {
            "samples lost on the way": count.lost - before[role].lost,
            "messages not understood and left out": count.malformed - before[role].malformed,
            "times its stream or its clock began anew": count.restarts - before[role].restarts,
        }
        told += [f"{role}: {number} {what}" for what, number in words.items() if number > 0]
    return told


def _drops(recorder: Recorder) -> list[str]:
    """Return a line for every stream of which samples were received but not written."""
    return [f"{name}: {count} samples not written" for name, count in recorder.dropped().items()]
