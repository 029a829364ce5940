"""The latest of every stream for somebody who looks on: bounded, decimated, and never in the way."""

import threading
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import FloatArray, Frame, IntArray, PoseBlock, WrenchBlock

_PERIOD_NS = 5_000_000
_IMAGE_PERIOD_NS = 500_000_000
_MOST_ROWS = 400
_IMAGE_STEP = 4


class LiveView:
    """An observer that keeps what is new until it is taken."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._force = _Decimated(7)
        self._pose = _Decimated(8)
        self._images: dict[str, NDArray[np.uint8]] = {}
        self._image_due_ns: dict[str, int] = {}
        self._heard_ns: dict[str, int] = {}

    def on_wrench(self, block: WrenchBlock) -> None:
        """Keep samples of the force sensor."""
        self._hear("force", len(block))
        with self._lock:
            self._force.add(block.host_time_ns, block.wrench)

    def on_pose(self, block: PoseBlock) -> None:
        """Keep states of the robot."""
        self._hear("robot", len(block))
        with self._lock:
            self._pose.add(block.host_time_ns, np.hstack([block.position, block.quaternion_wxyz]))

    def on_frames(self, camera: str, frames: Sequence[Frame]) -> None:
        """Keep a small copy of an image now and then."""
        self._hear(f"camera/{camera}", len(frames))
        if frames and frames[-1].host_time_ns >= self._image_due_ns.get(camera, 0):
            self._image_due_ns[camera] = frames[-1].host_time_ns + _IMAGE_PERIOD_NS
            small = frames[-1].image[::_IMAGE_STEP, ::_IMAGE_STEP].copy()
            with self._lock:
                self._images[camera] = small

    def on_failure(self, stream: str, error: DeviceError) -> None:
        """The session tells it."""

    def age_s(self, stream: str) -> float:
        """Return the age of the newest block of a stream, infinite before the first."""
        heard_ns = self._heard_ns.get(stream)
        return float("inf") if heard_ns is None else (host_time_ns() - heard_ns) * 1e-9

    def take(self) -> tuple[FloatArray, FloatArray, dict[str, NDArray[np.uint8]]]:
        """Return force (n, 7), pose (n, 8) and small images that came since the last call."""
        with self._lock:
            images, self._images = self._images, {}
            return self._force.take(), self._pose.take(), images

    def _hear(self, stream: str, samples: int) -> None:
        if samples:
            self._heard_ns[stream] = host_time_ns()


class _Decimated:
    """Rows of (time in s, values), the first of every 5 ms."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._rows: deque[FloatArray] = deque(maxlen=_MOST_ROWS)
        self._last_ns = 0

    def add(self, time_ns: IntArray, values: FloatArray) -> None:
        slots = time_ns // _PERIOD_NS
        fresh = np.flatnonzero(np.diff(slots, prepend=self._last_ns))
        if len(fresh):
            self._last_ns = int(slots[-1])
            self._rows.extend(np.column_stack([time_ns[fresh] * 1e-9, values[fresh]]))

    def take(self) -> FloatArray:
        rows = np.array(self._rows).reshape(-1, self._width)
        self._rows.clear()
        return rows
