"""A recorded session as what the live widgets show, at any instant."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.errors import DaqError, RecordingError, SynchronisationError
from daq.recording.events import MEASURE_BEGIN, MOVE_BEGIN
from daq.recording.folder import RIG_FILE
from daq.recording.reader import Recording
from daq.recording.stored_streams import Event, Images
from daq.rig import Rig, read_rig
from daq.synchronisation.windows import measuring_windows
from robot_drivers.protocols import FloatArray, IntArray, PoseBlock, WrenchBlock

_PERIOD_NS = 5_000_000
_IMAGE_STEP = 2
_ZERO_NS = 200_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Instant:
    """What the live widgets show.

    Attributes
    ----------
    force : (n, 7) of the last seconds: host time in s, wrench as read, N and N·m, sensor frame
    tool : (7,) ``T_base_tool``: position in m, quaternion with the scalar first; None before the first
    images : of each camera, at half its size, where there is one
    words : what the session was doing
    """

    force: FloatArray
    tool: FloatArray | None
    images: dict[str, NDArray[np.uint8]]
    words: str


@dataclass(frozen=True, eq=False)
class Playback:
    """A recording with its streams thinned for the eye.

    Attributes
    ----------
    rig : of the session; None where its file cannot be read
    begin_ns, end_ns : first and last receive stamp
    zero : (6,) reading at rest, N and N·m
    """

    rig: Rig | None
    begin_ns: int
    end_ns: int
    zero: FloatArray
    _force: FloatArray
    _robot: PoseBlock
    _images: dict[str, Images]
    _events: tuple[Event, ...]

    @property
    def duration_s(self) -> float:
        """From the first to the last sample."""
        return (self.end_ns - self.begin_ns) * 1e-9

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the recorded cameras."""
        return tuple(self._images)

    def at(self, position_s: float, span_s: float) -> Instant:
        """Return what is to be seen so long after the first sample, with the force of the last ``span_s``."""
        now_ns = self.begin_ns + round(position_s * 1e9)
        now_s = now_ns * 1e-9
        first, last = np.searchsorted(self._force[:, 0], [now_s - span_s, now_s], side="right")
        return Instant(
            self._force[first:last], self._tool(now_ns), self._pictures(now_ns), self._words(now_ns)
        )

    def _tool(self, now_ns: int) -> FloatArray | None:
        at = _last_before(self._robot.host_time_ns, now_ns)
        if at is None:
            return None
        return np.concatenate([self._robot.position[at], self._robot.quaternion_wxyz[at]])

    def _pictures(self, now_ns: int) -> dict[str, NDArray[np.uint8]]:
        found = {}
        for name, images in self._images.items():
            at = _last_before(images.host_time_ns, now_ns)
            if at is not None:
                found[name] = images.image(at)[::_IMAGE_STEP, ::_IMAGE_STEP]
        return found

    def _words(self, now_ns: int) -> str:
        words = "before the first step"
        for event in self._events:
            if event.time_ns > now_ns:
                break
            number = event.details.get("number")
            if event.name == MOVE_BEGIN:
                words = f"moving to step {number}"
            elif event.name == MEASURE_BEGIN:
                words = f"step {number}, measuring" if number else "measuring at rest"
        return words


def open_playback(session: Path) -> Playback:
    """Read a session, sealed or not.

    Raises
    ------
    RecordingError
        It is none, or it holds no sample.
    """
    recording = Recording(session)
    force, robot = recording.force, recording.robot
    images = {name: recording.images(name) for name in recording.cameras}
    stamps: list[IntArray] = [force.host_time_ns, robot.host_time_ns]
    stamps += [one.host_time_ns for one in images.values()]
    ends = [(int(one[0]), int(one[-1])) for one in stamps if len(one)]
    if not ends:
        raise RecordingError(f"{session}: holds no sample; there is nothing to replay")
    events = tuple(recording.events)
    return Playback(
        _rig_of(session),
        min(begin for begin, _ in ends),
        max(end for _, end in ends),
        _zero(force, events),
        _thinned(force),
        robot,
        images,
        events,
    )


def _rig_of(session: Path) -> Rig | None:
    try:
        return read_rig(session / RIG_FILE, to_connect=False)
    except DaqError:
        # an old session is looked at with the limits of today's rig
        return None


def _zero(force: WrenchBlock, events: tuple[Event, ...]) -> FloatArray:
    """Return the mean reading (6,) of the window at rest, or of the first moment where there is none."""
    if len(force) == 0:
        return np.zeros(6)
    try:
        rest = measuring_windows(events)[0]
        begin_ns, end_ns = rest.begin_ns, rest.end_ns
    except SynchronisationError:
        begin_ns, end_ns = int(force.host_time_ns[0]), int(force.host_time_ns[0]) + _ZERO_NS
    inside = (force.host_time_ns >= begin_ns) & (force.host_time_ns <= end_ns)
    return force.wrench[inside].mean(axis=0) if inside.any() else force.wrench[0]


def _thinned(force: WrenchBlock) -> FloatArray:
    """Return the first sample (n, 7) of every 5 ms, as the acquisition process shows them."""
    fresh = np.flatnonzero(np.diff(force.host_time_ns // _PERIOD_NS, prepend=-1))
    return np.column_stack([force.host_time_ns[fresh] * 1e-9, force.wrench[fresh]])


def _last_before(stamps: IntArray, now_ns: int) -> int | None:
    at = int(np.searchsorted(stamps, now_ns, side="right")) - 1
    return at if at >= 0 else None
