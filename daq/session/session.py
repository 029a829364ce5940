"""One retraction, from the check of its trajectory to the sealed folder.

Rest window, from which the guard takes its zero; for each step move, settle, measure. Events in the recording tell
the windows; nothing is averaged here. Whatever ends a session, the robot stands and the recording is sealed.
"""

import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from daq.devices import Devices
from daq.errors import RecordingError
from daq.progress import Progress
from daq.recording.folder import (
    CALIBRATION_FOLDER,
    RIG_FILE,
    SessionInfo,
    seal_session,
    sha256,
    write_info,
)
from daq.recording.recorder import Recorder
from daq.rig import Rig, write_rig
from daq.session.checks import check_limits, require_rest, tool_targets
from daq.session.guard import Guard
from daq.session.steps import StepRunner
from daq.trajectories import Trajectory
from daq.versions import package_versions
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Robot


@dataclass(frozen=True, slots=True)
class Label:
    """What the operator says about a session; ``order`` is 1 for the first experiment on a mounting."""

    name: str
    order: int = 1
    operator: str = ""
    notes: str = ""


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
    """Record one retraction with connected devices.

    Parameters
    ----------
    folder : of the session, must not exist
    progress : called in this thread

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
    state = devices.robot.state()
    require_rest(rig, state)
    targets = tool_targets(rig, trajectory, state.T_base_tool)
    check_limits(rig, trajectory, targets)
    devices.robot.check_trajectory(targets[1:], trajectory.speed)
    devices.force_sensor.start()
    _make_folder(rig, devices, trajectory, folder, label)
    guard = Guard(rig.limits, rig.frames, devices.robot)
    recorder = Recorder(folder, devices.force_sensor, devices.robot, devices.cameras, (guard,))
    problems: list[str] = []
    try:
        StepRunner(devices.robot, guard, recorder, progress).run(trajectory, targets)
    except BaseException as error:
        problems.append(_hold(devices.robot, guard, recorder, error))
        raise
    finally:
        recorder.close()
        devices.force_sensor.stop()
        problems += _losses(devices, recorder)
        progress("sealing the recording", len(targets), len(targets))
        info = seal_session(folder, tuple(problems))
    return info


def _make_folder(rig: Rig, devices: Devices, trajectory: Trajectory, folder: Path, label: Label) -> None:
    """Make the session folder with its description and copies of what is in force."""
    calibration = folder / CALIBRATION_FOLDER / rig.stereo_calibration.name
    try:
        folder.mkdir(parents=True)
        calibration.parent.mkdir()
        shutil.copyfile(rig.stereo_calibration, calibration)
    except OSError as error:
        raise RecordingError(f"{folder}: no session can be put there ({error}); name a new folder") from error
    write_rig(replace(rig, stereo_calibration=calibration), folder / RIG_FILE)
    info = SessionInfo(
        name=label.name,
        phantom_id=rig.specimen.phantom_id,
        order=label.order,
        operator=label.operator,
        notes=label.notes,
        trajectory=asdict(trajectory),
        versions=package_versions(),
        devices={role: device.identity for role, device in devices.all().items()},
        checksums={
            path.relative_to(folder).as_posix(): sha256(path) for path in (folder / RIG_FILE, calibration)
        },
    )
    write_info(folder, info)


def _hold(robot: Robot, guard: Guard, recorder: Recorder, error: BaseException) -> str:
    """Hold the robot after whatever went wrong, record it, and return what to write into the session."""
    reason = str(error) or "interrupted by the operator"
    details: dict[str, object] = {"reason": reason}
    if guard.stop is not None:
        details["guard"] = asdict(guard.stop)
    else:
        try:
            robot.hold()
        except DeviceError as refusal:
            details["hold_error"] = str(refusal)
    try:
        recorder.event("session_failed", **details)
    except RecordingError as failure:
        return f"{reason}; {failure}"
    return reason


def _losses(devices: Devices, recorder: Recorder) -> list[str]:
    """Return a line for every stream that lacks samples."""
    counts = {role: device.statistics() for role, device in devices.all().items()}
    lost = [f"{role}: {count.lost} samples lost on the way" for role, count in counts.items() if count.lost]
    dropped = [f"{name}: {count} samples not written" for name, count in recorder.dropped().items()]
    return lost + dropped
