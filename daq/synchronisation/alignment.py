"""Whether the streams of a session belong together in time: the same motion, seen by robot, force sensor and cameras.

Every session moves, so every session can be checked, whatever was calibrated before. A tissue that creeps follows the
gripper late by itself; a warning here is a reason to look, not a correction.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from daq.errors import DaqError, SynchronisationError
from daq.progress import Progress
from daq.recording.events import MOVE_BEGIN, MOVE_END
from daq.recording.reader import Recording
from daq.recording.stored_streams import Event
from daq.rig import Rig
from daq.synchronisation.exposed_images import exposed_images
from daq.synchronisation.fiducial_windows import track_fiducials
from daq.synchronisation.robot_motion import bead_motion, robot_motion
from daq.synchronisation.stream_times import force_times
from daq.timing.latency import main_motion
from robot_drivers.protocols import FloatArray, IntArray

WARN_BEYOND_S = 2e-3
FORCE_SENSOR, CAMERAS = "force sensor", "cameras"

_EDGE_NS = 300_000_000
_SIGNIFICANT = 3.0
_MOST_PAIRS = 80
_GROUPS = 5
_NO_MOVE = -1


@dataclass(frozen=True, slots=True)
class Alignment:
    """How much later a stream shows the motion than the robot does.

    Attributes
    ----------
    stream : "force sensor" or "cameras"
    lag_s, std_s : and the standard deviation of that; NaN where it cannot be told
    explained : share of the stream's motion that the robot's explains
    remark : why it cannot be told; empty where it can
    """

    stream: str
    lag_s: float = math.nan
    std_s: float = math.nan
    explained: float = math.nan
    remark: str = ""

    @property
    def misaligned(self) -> bool:
        """Whether the lag is beyond 2 ms, and no accident of noise."""
        return abs(self.lag_s) > max(WARN_BEYOND_S, _SIGNIFICANT * self.std_s)

    def __str__(self) -> str:
        if self.remark:
            return f"{self.stream}: its alignment with the robot cannot be told ({self.remark})"
        return (
            f"{self.stream}: {self.lag_s * 1e3:+.2f} ± {self.std_s * 1e3:.2f} ms against the robot's motion"
        )


def check_alignment(recording: Recording, rig: Rig, progress: Progress) -> tuple[Alignment, ...]:
    """Compare force and bead motion with the robot's; of the images only as many as a few moves need."""
    return (
        _told(FORCE_SENSOR, lambda: _force_alignment(recording, rig)),
        _told(CAMERAS, lambda: _camera_alignment(recording, rig, progress)),
    )


def _told(stream: str, estimate: Callable[[], Alignment]) -> Alignment:
    try:
        return estimate()
    except DaqError as error:
        return Alignment(stream, remark=str(error))


def _force_alignment(recording: Recording, rig: Rig) -> Alignment:
    force = recording.force
    time_ns = force_times(force, rig).time_ns
    move = np.where(force.usable, _move_of(recording.events, time_ns), _NO_MOVE)
    used = move != _NO_MOVE
    if not used.any():
        raise SynchronisationError("nothing was recorded while the robot moved")
    motion = main_motion(force.wrench[used, :3])
    return _against_robot(FORCE_SENSOR, recording, rig, time_ns[used], motion, move[used])


def _camera_alignment(recording: Recording, rig: Rig, progress: Progress) -> Alignment:
    images = exposed_images(recording, rig)
    move = _move_of(recording.events, images.exposed_ns)
    used = move != _NO_MOVE
    used[np.flatnonzero(used)[_MOST_PAIRS:]] = False
    if not used.any():
        raise SynchronisationError("no image was taken while the robot moved")
    track = track_fiducials(images, rig, used, progress)
    return _against_robot(CAMERAS, recording, rig, track.time_ns, bead_motion(track.positions), move[used])


def _against_robot(
    stream: str, recording: Recording, rig: Rig, time_ns: IntArray, signal: FloatArray, move: IntArray
) -> Alignment:
    """Estimate the lag of a signal (n,) whose samples belong to moves (n,); its spread by leaving moves out."""
    robot = robot_motion(recording, rig)
    whole = robot.latency_of(time_ns, signal)
    groups = min(_GROUPS, len(np.unique(move)))
    std_s = whole.std_s
    if groups > 1:
        # the jackknife over groups of moves (Efron, "The Jackknife, the Bootstrap and Other Resampling Plans", 1982)
        kept = [move % groups != group for group in range(groups)]
        lags = np.array([robot.latency_of(time_ns[part], signal[part]).lag_s for part in kept])
        std_s = float(np.sqrt((groups - 1) * lags.var()))
    return Alignment(stream, whole.lag_s, std_s, whole.explained)


def _move_of(events: Sequence[Event], time_ns: IntArray) -> IntArray:
    """Return in which move each instant lies, or just before or after which; -1 for none."""
    begins = [event.time_ns for event in events if event.name == MOVE_BEGIN]
    ends = [event.time_ns for event in events if event.name == MOVE_END]
    move = np.full(len(time_ns), _NO_MOVE, dtype=np.int64)
    spans = zip(begins, ends, strict=False)  # the last move of a session that was stopped has no end
    for number, (begin, end) in enumerate(spans):
        move[(time_ns >= begin - _EDGE_NS) & (time_ns <= end + _EDGE_NS)] = number
    return move
