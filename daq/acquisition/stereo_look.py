"""One pair of full images that were exposed together, for somebody who asked for it; of one camera one image."""

import threading
from collections.abc import Mapping, Sequence

import numpy as np

from daq.timing.pairing import pair_by_time
from robot_drivers.protocols import Frame

_MOST_FRAMES = 8
_TOLERANCE = 0.5  # of the time between two images


class StereoLook:
    """Waits, once asked, until every camera has an image of the same moment; keeps nothing while nobody asks.

    Two images are of the same moment if they arrived within half the time between two images of one camera.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._asked = False
        self._frames: dict[str, list[Frame]] = {}
        self._newest_ns: dict[str, int] = {}
        self._period_ns: dict[str, int] = {}

    def ask(self) -> None:
        """Ask for the next pair."""
        with self._lock:
            self._asked = True
            self._frames = {}

    def add(self, camera: str, frames: Sequence[Frame]) -> None:
        """See images of one camera."""
        if not frames:
            return
        stamp_ns = frames[-1].host_time_ns
        with self._lock:
            if (before_ns := self._newest_ns.get(camera)) is not None:
                self._period_ns[camera] = max(1, (stamp_ns - before_ns) // len(frames))
            self._newest_ns[camera] = stamp_ns
            if self._asked:
                kept = self._frames.setdefault(camera, [])
                kept += frames
                del kept[:-_MOST_FRAMES]

    def take(self, cameras: Sequence[str]) -> Mapping[str, Frame]:
        """Return a frame of each of two cameras once there is a pair of them, else nothing; of one its newest."""
        with self._lock:
            if len(cameras) == 1:
                return self._newest_of(cameras[0])
            first, second = cameras
            frames = [self._frames.get(name, []) for name in (first, second)]
            if not self._asked or not all(frames):
                return {}
            stamps = [np.array([frame.host_time_ns for frame in kept]) for kept in frames]
            period_ns = max(self._period_ns.get(name, 0) for name in (first, second))
            pairs = pair_by_time(stamps[0], stamps[1], _TOLERANCE * period_ns).index
            if not len(pairs):
                return {}
            self._asked = False
            left, right = pairs[-1]
            return {first: frames[0][left], second: frames[1][right]}

    def _newest_of(self, camera: str) -> Mapping[str, Frame]:
        frames = self._frames.get(camera, [])
        if not self._asked or not frames:
            return {}
        self._asked = False
        return {camera: frames[-1]}
