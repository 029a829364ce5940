"""One retraction, from the check of its trajectory to the sealed folder.

Rest window, from which the guard takes its zero; for each step move, settle, measure. Events in the recording tell
the windows; nothing is averaged here. Whatever ends a session, the robot stands and the recording is sealed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Protocol

from daq.calibration_files.in_force import calibrations_in_force
from daq.devices import Devices
from daq.errors import RecordingError, SessionError
from daq.progress import Progress, silent
from daq.recording.events import GUARD_LATENCY, PACE
from daq.recording.folder import (
    RIG_FILE,
    SessionInfo,
    seal_session,
    write_info,
)
from daq.recording.in_use import locked
from daq.recording.reader import Recording
from daq.recording.recorder import Recorder
from daq.recording.streams import Observer
from daq.rig import Rig
from daq.session.checks import check_limits, require_joints, require_rest, tool_targets
from daq.session.folder import make_folder
from daq.session.guard import Guard, Stop
from daq.session.losses import drops, losses_between, statistics
from daq.session.pace import Instant
from daq.session.steps import StepRunner
from daq.session_report import write_report
from daq.trajectories import Trajectory
from daq.versions import package_versions
from daq.vision.camera_model import PinholeCamera
from robot_drivers.clock import host_time_ns, wait_until
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


class RecordSession(Protocol):
    """Carries out one session with devices that it knows, as :meth:`Session.run` does."""

    def __call__(
        self, trajectory: Trajectory, folder: Path, label: Label, progress: Progress, /
    ) -> SessionInfo:
        """Record one retraction into a new folder."""


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
        require_joints(self._rig, state)
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
        SessionError
            The controller has stopped the robot, or refuses a step of a session under way; the same.
        DeviceError, RecordingError
            A device or the disk failed; the robot is held, the recording is sealed as far as it goes.
        KeyboardInterrupt
            The same.
        """
        devices = self._devices
        targets = self.check()
        models = _camera_models(self._rig)
        devices.force_sensor.start()
        # what gathered while nobody read is not of this session, nor is what has been lost of it
        devices.robot.read(0.0)
        for camera in devices.cameras.values():
            camera.read(0.0)
        self._make_folder()
        with locked(self.folder / RIG_FILE):
            return self._record(targets, models, progress)

    def _make_folder(self) -> None:
        """Make the session folder with its description and copies of what is in force."""
        checksums = make_folder(self.folder, self._rig, self._in_force)
        label = self._label
        info = SessionInfo(
            name=label.name,
            phantom_id=self._rig.specimen.phantom_id,
            order=label.order,
            operator=label.operator,
            notes=label.notes,
            trajectory=asdict(self._trajectory),
            versions=package_versions(),
            calibrations=self._in_force.describe(),
            devices={role: device.identity for role, device in self._devices.all().items()},
            checksums=checksums,
        )
        write_info(self.folder, info)

    def _record(
        self, targets: Sequence[Pose], models: Mapping[str, PinholeCamera], progress: Progress
    ) -> SessionInfo:
        """Record into the folder, and seal it, however the retraction ends."""
        devices, trajectory = self._devices, self._trajectory
        self._before, began = statistics(devices), Instant.now()
        recorder = self._recorder = Recorder(
            self.folder,
            devices,
            (self._guard, *self._observers),
            models,
            tell_failure=lambda failure: self._guard.hold(str(failure)),
            with_depth=self._rig.with_depth,
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
            losses = losses_between(self._before, self._after or statistics(self._devices))
        except DeviceError:
            losses = []  # a device that is lost is told as what ends the session
        return (*self._in_force.warnings, *losses, *drops(self._recorder), *self._marks)

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

    def _end(self, recorder: Recorder, began: Instant) -> list[str]:
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
        self._after = statistics(self._devices)
        return [*self.problems(), *problems]


def _camera_models(rig: Rig) -> dict[str, PinholeCamera]:
    if rig.only_view is not None:
        return {rig.cameras[0].name: rig.only_view.camera()}
    if rig.stereo_calibration is None:
        return {}
    calibration, (left, right) = rig.stereo(), rig.pair
    return {left.name: calibration.left, right.name: calibration.right}
