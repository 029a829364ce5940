"""Calibrations that a motion makes: a session under the guard records it, and the recording is evaluated.

The session folder is kept beside the calibration, so it can be evaluated again.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from daq.calibration.force import calibrate_force
from daq.calibration.latencies import calibrate_time
from daq.calibration.registration import calibrate_robot
from daq.calibration_files.outcome import Kind, Outcome
from daq.devices import Devices
from daq.errors import CalibrationError
from daq.progress import Progress
from daq.recording.reader import Recording
from daq.rig import Rig
from daq.session.session import Label, run_session
from daq.trajectories.routines import NAMED

MOTIONS: Mapping[Kind, tuple[str, ...]] = {
    "force": ("tare_poses",),
    "robot": ("marker_poses",),
    "time": ("sway", "tap"),
}
"""The trajectories of :data:`~daq.trajectories.routines.NAMED` that a calibration can be made from, the usual first."""

SERIALS: Mapping[Kind, tuple[str, ...]] = {
    "camera": ("camera",),
    "cameras": ("camera",),
    "stereo": ("camera",),
    "robot": ("camera", "robot"),
    "force": ("force sensor",),
    "time": ("camera", "force sensor", "robot"),
    "tool": ("robot",),
}
"""The devices that a calibration is of, by the beginning of their roles."""


def record_motion(
    kind: Kind, motion: str, rig: Rig, devices: Devices, folder: Path, progress: Progress
) -> Recording:
    """Carry out the motion of a calibration under the guard and record it in a new session folder.

    Raises
    ------
    CalibrationError
        The calibration cannot be made from this motion.
    SessionError, MotionLimitError, DeviceError, RecordingError
        As :func:`daq.session.session.run_session` does.
    """
    if motion not in MOTIONS.get(kind, ()):
        raise CalibrationError(
            f"{kind}: cannot be made from {motion!r}, but from {', '.join(MOTIONS.get(kind, ()))}"
        )
    run_session(rig, devices, NAMED[motion](), folder, Label(f"calibrate {kind}"), progress)
    return Recording(folder)


def evaluate(kind: Kind, recording: Recording, progress: Progress) -> Outcome[Any]:
    """Evaluate a recording of :func:`record_motion`, now or later.

    Raises
    ------
    CalibrationError, SynchronisationError
        The recording does not determine what is sought.
    """
    evaluations: Mapping[Kind, Callable[[], Outcome[Any]]] = {
        "force": lambda: calibrate_force(recording, progress),
        "robot": lambda: calibrate_robot(recording, progress),
        "time": lambda: calibrate_time(recording, progress),
    }
    if kind not in evaluations:
        raise CalibrationError(f"{kind}: is not made from a recording; it needs a person at the rig")
    return evaluations[kind]()


def serials_of(kind: Kind, serials: Mapping[str, str]) -> dict[str, str]:
    """Return the serial numbers, by role, of the devices that a calibration is of."""
    return {role: serial for role, serial in serials.items() if role.startswith(SERIALS[kind])}
