"""The latest of every stream for somebody who looks on: bounded, decimated, and never in the way."""

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.acquisition.stereo_look import StereoLook
from daq.blocks import joined
from daq.timing.clock_watch import ClockWatch
from robot_drivers.ati.compensation.tare import Tare, take_tare
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import FloatArray, Frame, IntArray, PoseBlock, WrenchBlock

_PERIOD_NS = 5_000_000
_IMAGE_PERIOD_NS = 20_000_000  # every image of a camera with 30 a second, also of one that is 13 ms late
_MOST_ROWS = 400
IMAGE_STEP = 4
_TARE_S = 1.0


class LiveView:
    """An observer that keeps what is new until it is taken.

    Attributes
    ----------
    look : for who wants both cameras' full images of one moment
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._force = _Decimated(7)
        self._pose = _Decimated(8)
        self._images: dict[str, NDArray[np.uint8]] = {}
        self._image_due_ns: dict[str, int] = {}
        self._complete = threading.Event()
        self._heard_ns: dict[str, int] = {}
        self._recent: deque[WrenchBlock] = deque()
        self._clocks: dict[str, ClockWatch] = {}
        self.look = StereoLook()

    def on_wrench(self, block: WrenchBlock) -> None:
        """Keep samples of the force sensor."""
        self._hear("force", block.device_time_s[-1:], block.host_time_ns[-1:])
        with self._lock:
            self._force.add(block.host_time_ns, block.wrench)
            self._keep(block)

    def on_pose(self, block: PoseBlock) -> None:
        """Keep states of the robot."""
        self._hear("robot", block.device_time_s[-1:], block.host_time_ns[-1:])
        with self._lock:
            self._pose.add(block.host_time_ns, np.hstack([block.position, block.quaternion_wxyz]))

    def on_frames(self, camera: str, frames: Sequence[Frame]) -> None:
        """Keep a small copy of the latest image."""
        device_times_s = [frame.device_time_s for frame in frames[-1:] if frame.device_time_s is not None]
        self._hear(f"camera/{camera}", device_times_s, [frame.host_time_ns for frame in frames[-1:]])
        self.look.add(camera, frames)
        if frames and frames[-1].host_time_ns >= self._image_due_ns.get(camera, 0):
            self._image_due_ns[camera] = frames[-1].host_time_ns + _IMAGE_PERIOD_NS
            small = frames[-1].image[::IMAGE_STEP, ::IMAGE_STEP].copy()
            with self._lock:
                self._images[camera] = small
                if len(self._images) == len(self._image_due_ns):
                    self._complete.set()

    def on_failure(self, stream: str, error: DeviceError) -> None:
        """The session tells it."""

    def age_s(self, stream: str) -> float:
        """Return the age of the newest block of a stream, infinite before the first."""
        heard_ns = self._heard_ns.get(stream)
        return float("inf") if heard_ns is None else (host_time_ns() - heard_ns) * 1e-9

    def wait_for_images(self, timeout_s: float) -> bool:
        """Wait until every camera has a new image to show; return False where that takes longer."""
        return self._complete.wait(timeout_s)

    def take(self) -> tuple[FloatArray, FloatArray, dict[str, NDArray[np.uint8]]]:
        """Return force (n, 7), pose (n, 8) and small images that came since the last call."""
        with self._lock:
            images, self._images = self._images, {}
            self._complete.clear()
            return self._force.take(), self._pose.take(), images

    def sync_s(self, stream: str) -> float:
        """Return how well the stream's clock is known on the host's, s; NaN where it has none or is too new."""
        with self._lock:
            watch = self._clocks.get(stream)
            return float("nan") if watch is None else watch.uncertainty_s()

    def tare(self) -> Tare:
        """Take the last second of the force sensor for zero; the readings stay as they are.

        Raises
        ------
        TareRefusedError
            The load moves, or too little came.
        """
        with self._lock:
            blocks = list(self._recent)
        return take_tare(_joined(blocks))

    def _keep(self, block: WrenchBlock) -> None:
        """Keep the blocks of the last second."""
        if len(block):
            self._recent.append(block)
            while block.host_time_ns[-1] - self._recent[0].host_time_ns[-1] > _TARE_S * 1e9:
                self._recent.popleft()

    def _hear(self, stream: str, device_time_s: ArrayLike, host_time: ArrayLike) -> None:
        """Note that something came; the times are those of the newest sample, (1,) or (0,) without one."""
        stamps, clock = np.asarray(host_time), np.asarray(device_time_s)
        if len(stamps):
            self._heard_ns[stream] = host_time_ns()
        if len(stamps) and len(clock):
            with self._lock:
                self._clocks.setdefault(stream, ClockWatch()).add(float(clock[0]), int(stamps[0]))


def _joined(blocks: Sequence[WrenchBlock]) -> WrenchBlock:
    """Return consecutive blocks as one, an empty one where there are none."""
    if not blocks:
        none = dict.fromkeys([field.name for field in fields(WrenchBlock)], np.empty(0, dtype=np.int64))
        return WrenchBlock(**{**none, "wrench": np.empty((0, 6))})  # type: ignore[arg-type]
    return joined(blocks)


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
