"""The latency of force sensor and cameras against the robot, from a recording of a sway or of taps."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure as Plot
from numpy.typing import NDArray

from daq.calibration_files.outcome import Figure, Outcome
from daq.calibration_files.results import StreamLatency, TimeResult
from daq.errors import CalibrationError
from daq.progress import Progress
from daq.recording.folder import RIG_FILE
from daq.recording.reader import Recording
from daq.rig import Rig, read_rig
from daq.synchronisation.exposed_images import exposed_images
from daq.synchronisation.fiducial_windows import track_fiducials
from daq.synchronisation.robot_motion import bead_motion, robot_motion
from daq.synchronisation.stream_times import force_times
from daq.synchronisation.windows import measuring_windows
from daq.timing.latency import Latency, main_motion
from robot_drivers.protocols import IntArray

MOST_STD_S = 5e-4
LEAST_EXPLAINED = 0.9
FORCE, CAMERAS = "force sensor", "cameras"

_EDGE_S = 0.3


def calibrate_time(recording: Recording, progress: Progress) -> Outcome[TimeResult]:
    """Find the latencies from a recording of :func:`~daq.trajectories.routines.sway` or ``tap``.

    The latencies that the rig file states already are taken off first and added to what is found, so the result is the
    whole latency. That of the images is found where beads are measured in them.

    Raises
    ------
    CalibrationError, SynchronisationError
        The recording holds no motion that both streams show.
    """
    rig = read_rig(recording.folder / RIG_FILE, to_connect=False)
    found: dict[str, Latency] = {FORCE: _whole(force_latency(recording, rig), rig.latencies.force_s)}
    if rig.measuring_cameras:
        found[CAMERAS] = _whole(camera_latency(recording, rig, progress), rig.latencies.cameras_s)
    result = TimeResult(
        procedure=str(recording.info.trajectory["kind"]),
        streams=tuple(
            StreamLatency(
                stream,
                latency.lag_s,
                latency.std_s,
                tuple(latency.lags_s.tolist()),
                tuple(latency.correlation.tolist()),
                tuple(latency.correlation_std.tolist()),
            )
            for stream, latency in found.items()
        ),
    )
    return Outcome("time", result, _figures(found, result), lambda plot: _draw(plot, found))


def force_latency(recording: Recording, rig: Rig) -> Latency:
    """Return how late the force is stamped against the robot's pose, beyond what the rig file states."""
    force = recording.force
    time_ns = force_times(force, rig).time_ns
    used = force.usable & _while_moving(recording, time_ns)
    if not used.any():
        raise CalibrationError("time: the force sensor has no sample while the robot moves; record again")
    return robot_motion(recording, rig).latency_of(time_ns[used], main_motion(force.wrench[used, :3]))


def camera_latency(recording: Recording, rig: Rig, progress: Progress) -> Latency:
    """Return how late the images are stamped against the robot's pose, beyond what the rig file states."""
    images = exposed_images(recording, rig)
    rest = measuring_windows(recording.events)[0]
    track = track_fiducials(images, rig, images.exposed_ns >= rest.begin_ns, progress)
    moving = _while_moving(recording, track.time_ns)
    motion = bead_motion(track.positions[moving])
    return robot_motion(recording, rig).latency_of(track.time_ns[moving], motion)


def _whole(beyond: Latency, known_s: float) -> Latency:
    """Return a latency with what was known and taken off before."""
    return replace(beyond, lag_s=beyond.lag_s + known_s, lags_s=beyond.lags_s + known_s)


def _while_moving(recording: Recording, time_ns: IntArray) -> NDArray[np.bool_]:
    """Tell which instants lie between the windows at both ends, with a margin around the motion."""
    windows = measuring_windows(recording.events)
    if len(windows) < 2:
        raise CalibrationError("time: the recording has no window after its motion; let it end by itself")
    margin_ns = round(_EDGE_S * 1e9)
    begin_ns, end_ns = windows[0].end_ns - margin_ns, windows[-1].begin_ns + margin_ns
    inside: NDArray[np.bool_] = (time_ns >= begin_ns) & (time_ns <= end_ns)
    return inside


def _figures(found: Mapping[str, Latency], result: TimeResult) -> tuple[Figure, ...]:
    figures = []
    for told in result.streams:
        latency = found[told.stream]
        figures += [
            Figure(f"{told.stream}, latency", told.latency_s * 1e3, "ms"),
            Figure(f"{told.stream}, standard deviation", told.std_s * 1e3, "ms", most=MOST_STD_S * 1e3),
            Figure(f"{told.stream}, explained by the motion", latency.explained, "", least=LEAST_EXPLAINED),
        ]
    return tuple(figures)


def _draw(plot: Plot, found: Mapping[str, Latency]) -> None:
    for axes, (stream, latency) in zip(
        plot.subplots(1, len(found), squeeze=False)[0], found.items(), strict=True
    ):
        lags_ms = latency.lags_s * 1e3
        axes.fill_between(
            lags_ms,
            latency.correlation - latency.correlation_std,
            latency.correlation + latency.correlation_std,
            alpha=0.3,
        )
        axes.plot(lags_ms, latency.correlation)
        axes.axvline(latency.lag_s * 1e3, linestyle="--")
        axes.set(title=stream, xlabel="lag, ms", ylabel="correlation with the robot's motion")
