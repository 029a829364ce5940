"""Synchronising a session while it is recorded: each look at it costs what is new, and gives what the whole would.

A pair of images is looked at once, as soon as it is there, also in a window that is still being measured, and of fast
cameras only :data:`PAIRS_PER_S`. Clocks are estimated anew from all stamps whenever a window has ended, which costs
little; so the rows are those that :func:`~daq.synchronisation.experiment_rows.synchronise` makes of the same recording
with as many pairs. Nothing of a later window is looked at before an earlier one is a row, and who has fallen a window
behind looks at fewer pairs.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from daq.recording.folder import RIG_FILE
from daq.recording.running import RunningRecording
from daq.rig import Rig, read_rig
from daq.synchronisation.experiment_rows import Synchronised, brought_together, signal_means
from daq.synchronisation.exposed_images import ExposedImages, bead_tracker, exposed_images
from daq.synchronisation.fiducial_windows import (
    FiducialMeans,
    FiducialTrack,
    means_of_track,
    needed_pairs,
    no_fiducials,
)
from daq.synchronisation.stream_times import force_times, robot_times
from daq.synchronisation.windows import UNDER_WAY, Window, measuring_windows, windows_begun
from daq.timing.event_times import EventTimes
from robot_drivers.protocols import FloatArray, IntArray

# Estimated times move a little as more stamps come: pairs this close to a window are looked at in case they are in it.
_EDGE_NS = 50_000_000
# A stream that has stopped is not waited for; one whose images wait to be encoded is.
_PATIENCE_NS = 5_000_000_000
PAIRS_PER_S = 4.5
"""Of images that are looked at in a window, about: a pair takes some 30 ms of a processor that also records."""

PAIRS_PER_S_BEHIND = 2.0
"""The same of a window after which another has begun."""

_FEWEST = 2  # samples of a stream without which it has no clock


class RunningSynchronisation:
    """Follows the recording in a session folder, which may still be written."""

    def __init__(self, folder: Path) -> None:
        self._recording = RunningRecording(folder)
        self._rig = read_rig(folder / RIG_FILE, to_connect=False)
        self._fiducials = _RunningFiducials(self._rig) if self._rig.measuring_cameras else None
        self._rows = 0

    def read_on(self) -> Synchronised | None:
        """Read what was recorded since the last time; return all rows so far where there is one more, else None.

        A window becomes a row once every stream is beyond its end, or five seconds behind the others. Of several that
        have, each call takes one, so that the first need not wait until the beads in the last are found.

        Raises
        ------
        RecordingError
            What is recorded cannot be read.
        SynchronisationError, VisionError
            As :func:`~daq.synchronisation.experiment_rows.synchronise`.
        """
        return self._read(self._passed)

    def read_rest(self) -> Synchronised | None:
        """Read on in a recording that nobody writes any more: no window is waited for; raises as :meth:`read_on`."""
        return self._read(lambda exposed, windows: list(windows))

    def _read(
        self, complete: Callable[[Mapping[str, EventTimes], Sequence[Window]], list[Window]]
    ) -> Synchronised | None:
        """Read on; return all rows where the window behind the last of them is complete."""
        recording, rig = self._recording, self._rig
        recording.read_on()
        begun = windows_begun(recording.events)
        if not begun:
            return None
        following = self._rows + 1
        seen = self._seen(begun, following)
        if seen is None or sum(window.end_ns != UNDER_WAY for window in begun) == self._rows:
            return None
        measured = complete(seen.times, measuring_windows(recording.events))[:following]
        if len(measured) == self._rows:
            return None
        self._rows = len(measured)
        signals = signal_means(recording.force, recording.robot, rig, measured)
        return brought_together(recording.info, rig, measured, signals, seen.means(measured))

    def _seen(self, begun: Sequence[Window], following: int) -> "_Seen | None":
        """Look at the images that are new, up to so many windows; None while there are too few."""
        recording, rig, fiducials = self._recording, self._rig, self._fiducials
        if fiducials is None:
            recording.let_go_images(begun[-1].begin_ns)
            return _Seen({}, no_fiducials)
        cameras = [camera.name for camera in rig.measuring_cameras]
        if not set(cameras) <= set(recording.cameras):
            return None
        if any(len(recording.images(name)) < _FEWEST for name in cameras):
            return None
        images = exposed_images(recording, rig)
        pairs_per_s = PAIRS_PER_S if len(begun) <= following else PAIRS_PER_S_BEHIND
        track = fiducials.look(images, begun[:following], pairs_per_s)
        recording.let_go_images(fiducials.looked_until_ns)
        return _Seen(images.times, lambda windows: means_of_track(images, track, windows))

    def _passed(self, exposed: Mapping[str, EventTimes], windows: Sequence[Window]) -> list[Window]:
        """Return the windows that no stream still has something to say of."""
        if self._recording.sealed:
            return list(windows)
        force, robot = self._recording.force, self._recording.robot
        if min(len(force), len(robot)) < _FEWEST:
            return []
        times = (force_times(force, self._rig), robot_times(robot), *exposed.values())
        newest = [int(stream.time_ns[-1]) for stream in times]
        passed_ns = max(min(newest), max(newest) - _PATIENCE_NS)
        return [window for window in windows if window.end_ns < passed_ns]


@dataclass(frozen=True, slots=True)
class _Seen:
    """What the cameras have shown so far: their exposure times by role, and the beads' means over windows."""

    times: Mapping[str, EventTimes]
    means: Callable[[Sequence[Window]], FiducialMeans]


class _RunningFiducials:
    """The beads in the pairs of images so far.

    Attributes
    ----------
    looked_until_ns : when the last pair that was looked at was exposed; 0 before the first
    """

    def __init__(self, rig: Rig) -> None:
        self._track = bead_tracker(rig)
        self._beads = len(rig.specimen.fiducials_m)
        self._left: list[int] = []
        self._positions: list[FloatArray] = []
        self._rejected: Counter[str] = Counter()
        self._began_ns = self.looked_until_ns = 0

    def look(self, images: ExposedImages, windows: Sequence[Window], most_per_s: float) -> FiducialTrack:
        """Look at the pairs that are new and needed; return what all of them show."""
        last = self._left[-1] if self._left else -1
        wide = [
            replace(window, begin_ns=window.begin_ns - _EDGE_NS, end_ns=window.end_ns + _EDGE_NS)
            for window in windows
        ]
        chosen = needed_pairs(images, wide, most_per_s) & (images.pairs[:, 0] > last)
        exposed_ns = images.exposed_ns[chosen]
        for left, time_ns, pair in zip(
            images.pairs[chosen, 0].tolist(), exposed_ns.tolist(), images.decoded(chosen), strict=True
        ):
            self._began_ns = self._began_ns or time_ns
            seen = self._track(pair, (time_ns - self._began_ns) * 1e-9)
            self._left.append(left)
            self._positions.append(seen.positions)
            self._rejected.update(seen.rejected)
            self.looked_until_ns = time_ns
        positions = np.array(self._positions).reshape(len(self._left), self._beads, 3)
        return FiducialTrack(self._exposed_ns(images), positions, dict(self._rejected))

    def _exposed_ns(self, images: ExposedImages) -> IntArray:
        """Return when the pairs (k,) that were looked at were exposed, by all that is known now."""
        left = next(iter(images.times.values()))
        return left.time_ns[np.array(self._left, dtype=np.intp)]
