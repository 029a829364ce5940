"""What a recording tells about its own quality: clocks, gaps, the guard's quickness, and how its streams align.

Computed from the raw stamps, so it can be made anew at any time, with better methods too; ``derived/report.json`` in
the session's folder is a copy that may be deleted.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from daq.errors import DaqError, RecordingError
from daq.progress import Progress
from daq.recording.events import GUARD_LATENCY, PACE
from daq.recording.folder import DERIVED_FOLDER, RIG_FILE
from daq.recording.reader import Recording
from daq.rig import read_rig
from daq.synchronisation.alignment import WARN_BEYOND_S, Alignment, check_alignment
from daq.synchronisation.stream_times import SECOND_NS, clock_times, robot_times
from daq.timing.event_times import EventTimes, clock_starts, estimate_event_times
from estimator.errors import InputError
from estimator.input_file import parse_json, read_input_text
from estimator.json_dataclass import from_json
from robot_drivers.protocols import FloatArray, IntArray

REPORT_FILE = "report.json"
_WORTH_TELLING = 1.05


@dataclass(frozen=True, slots=True)
class StreamQuality:
    """One stream.

    Attributes
    ----------
    samples : in the file
    missing : by the device's counter, between the first and the last of them
    period_s : between samples
    gaps, longest_gap_s : places where more than one and a half periods passed
    resets : how often the device's counter or clock started anew
    drift_ppm : how much faster the device's clock runs than the host's; NaN where it has none
    wander_ppm : largest change of its rate between windows of a minute
    delay_s : 50 %, 95 %, 99.9 % and largest delay of the receive stamps over the estimated times
    """

    samples: int
    missing: int
    period_s: float
    gaps: int
    longest_gap_s: float
    resets: int
    drift_ppm: float
    wander_ppm: float
    delay_s: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class SessionReport:
    """The quality of one recording.

    Attributes
    ----------
    streams : by name; one with fewer than two samples is left out
    guard : blocks of force samples that the guard checked, and the time that took from the stamp of the oldest sample
        in them (median, 99.9 %, longest), s; where it stopped the robot, also why and how soon
    alignments : of the streams with the robot
    slowdown : how many times slower than real time an emulated laboratory ran; 1 of a real one
    """

    streams: Mapping[str, StreamQuality]
    guard: Mapping[str, Any]
    alignments: tuple[Alignment, ...]
    slowdown: float = 1.0

    @property
    def warnings(self) -> tuple[str, ...]:
        """What an analyst must know."""
        anew = tuple(
            f"{name}: its clock jumped or began anew {stream.resets} times; instants on either side are estimated apart"
            for name, stream in self.streams.items()
            if stream.resets
        )
        return anew + tuple(
            f"{alignment}: beyond {WARN_BEYOND_S * 1e3:g} ms; calibrate the time"
            for alignment in self.alignments
            if alignment.misaligned
        )

    def lines(self) -> list[str]:
        """Return the report for a person."""
        told = []
        for name, stream in self.streams.items():
            drift = "" if math.isnan(stream.drift_ppm) else f", clock {stream.drift_ppm:+.1f} ppm"
            told.append(
                f"{name}: {1 / stream.period_s:.1f}/s, {stream.missing} missing, {stream.gaps} gaps, "
                f"{stream.resets} resets{drift}, stamps late by {stream.delay_s[0] * 1e3:.2f} ms (median), "
                f"{stream.delay_s[2] * 1e3:.2f} ms (99.9 %)"
            )
        if "most_s" in self.guard:
            told.append(
                f"guard: force checked within {self.guard['most_s'] * 1e3:.1f} ms (99.9 %), "
                f"{self.guard['longest_s'] * 1e3:.1f} ms at most"
            )
        return [*told, *map(str, self.alignments), *self.pace_lines()]

    def pace_lines(self) -> list[str]:
        """Return what there is to say of an emulated laboratory's pace: nothing where it was that of real time."""
        if self.slowdown < _WORTH_TELLING:
            return []
        return [f"the emulated laboratory ran {self.slowdown:.1f} times slower than real time"]


def report_session(recording: Recording, progress: Progress) -> SessionReport:
    """Judge a recording, sealed or not, whole or cut off."""
    paces = [event.details["slowdown"] for event in recording.events if event.name == PACE]
    return SessionReport(
        _streams(recording), _guard(recording), _alignments(recording, progress), max(paces, default=1.0)
    )


def write_report(recording: Recording, progress: Progress) -> SessionReport:
    """Judge a recording and keep what was found in its folder."""
    report = report_session(recording, progress)
    folder = recording.folder / DERIVED_FOLDER
    folder.mkdir(exist_ok=True)
    (folder / REPORT_FILE).write_text(
        json.dumps(_without_nan({**asdict(report), "warnings": report.warnings}), indent=2) + "\n",
        encoding="utf-8",
    )
    return report


def read_report(session: Path) -> SessionReport:
    """Read what :func:`write_report` kept in the folder of a session.

    Raises
    ------
    RecordingError
        There is none, or it is of another version; make it anew.
    """
    path = session / DERIVED_FOLDER / REPORT_FILE
    try:
        content = _with_nan(parse_json(read_input_text(path), path))
        streams = {name: from_json(StreamQuality, stream) for name, stream in content["streams"].items()}
        alignments = tuple(from_json(Alignment, alignment) for alignment in content["alignments"])
        guard = content["guard"]
        if not all(stream.period_s > 0 for stream in streams.values()):
            raise ValueError("a period is not positive")
        if "most_s" in guard and not all(isinstance(guard[name], float) for name in ("most_s", "longest_s")):
            raise ValueError("a time of the guard is none")
        slowdown = content.get("slowdown", 1.0)
        if not isinstance(slowdown, float):
            raise ValueError("the slowdown is none")
        return SessionReport(streams, guard, alignments, slowdown)
    except InputError as error:
        raise RecordingError(f"{error}; make the report anew") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RecordingError(f"{path}: cannot be read ({error!r}); make the report anew") from error


def _without_nan(value: Any) -> Any:
    """Return a value whose NaN are None, for JSON knows no NaN."""
    if isinstance(value, Mapping):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _with_nan(value: Any) -> Any:
    """Return what :func:`_without_nan` was given."""
    if isinstance(value, dict):
        return {key: _with_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_nan(item) for item in value]
    return math.nan if value is None else value


def _streams(recording: Recording) -> dict[str, StreamQuality]:
    force, robot = recording.force, recording.robot
    streams = {}
    if len(force) > 1:
        times = estimate_event_times(force.counter, force.host_time_ns)
        streams["force"] = _quality(times, force.counter, force.device_time_s)
    if len(robot) > 1:
        streams["robot"] = _quality(robot_times(robot), robot.counter, robot.device_time_s)
    for name in recording.cameras:
        images = recording.images(name)
        if len(images) > 1:
            times = clock_times(images.device_time_s, images.host_time_ns, images.counter)
            streams[f"camera {name}"] = _quality(times, images.counter, images.device_time_s)
    return streams


def _quality(times: EventTimes, counter: IntArray, device_time_s: FloatArray) -> StreamQuality:
    in_order = np.sort(times.time_ns)
    ends = np.maximum(np.searchsorted(in_order, times.time_ns[times.gap_ends]), 1)
    at_gaps = in_order[ends] - in_order[ends - 1]
    return StreamQuality(
        samples=len(counter),
        missing=_missing(counter, times.time_ns),
        period_s=times.period_s,
        gaps=len(times.gap_ends),
        longest_gap_s=float(at_gaps.max(initial=0)) * 1e-9,
        resets=times.resets,
        drift_ppm=_drift_ppm(device_time_s, times.time_ns, counter),
        wander_ppm=times.wander_ppm,
        delay_s=times.residual_s,
    )


def _missing(counter: IntArray, time_ns: IntArray) -> int:
    """Return how many numbers are missing, whatever the order in which the others came."""
    stretches = np.split(counter, clock_starts(counter.astype(np.float64), time_ns))
    return sum(max(0, int(np.ptp(stretch)) + 1 - len(stretch)) for stretch in stretches)


def _drift_ppm(device_time_s: FloatArray, time_ns: IntArray, counter: IntArray) -> float:
    """Return how much faster a clock runs than the host's, over its longest stretch without a reset."""
    starts = clock_starts(device_time_s, time_ns, SECOND_NS, counter)
    longest = max(np.split(np.arange(len(device_time_s)), starts), key=len)
    host_s = (time_ns[longest] - time_ns[longest[0]]) * 1e-9
    if not np.all(np.isfinite(device_time_s)) or len(longest) < 2 or host_s[-1] == 0:
        return math.nan
    rate = np.polyfit(host_s, device_time_s[longest] - device_time_s[longest[0]], 1)[0]
    return float(1e6 * (rate - 1.0))


def _guard(recording: Recording) -> dict[str, Any]:
    told: dict[str, Any] = {}
    for event in recording.events:
        if event.name == GUARD_LATENCY:
            told |= event.details
        elif event.name == "session_failed":
            told["stop"] = event.details["guard"]
    return told


def _alignments(recording: Recording, progress: Progress) -> tuple[Alignment, ...]:
    try:
        rig = read_rig(recording.folder / RIG_FILE, to_connect=False)
    except DaqError as error:
        return (Alignment("all streams", remark=str(error)),)
    return check_alignment(recording, rig, progress)
