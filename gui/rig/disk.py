"""How long may still be recorded before the disk is full."""

import math
import shutil
from pathlib import Path

from PySide6.QtCore import QObject, QRunnable, QThreadPool, QTimer, Signal

from daq.acquisition.live_view import IMAGE_STEP
from daq.acquisition.messages import Telemetry
from daq.recording.streams import FORCE, ROBOT
from gui.rig.state import RigState

_PERIOD_MS = 5000
_BYTES_PER_SAMPLE = {FORCE: 120.0, ROBOT: 220.0}
"""As they are in the file, with their headers."""


def bytes_per_s(state: RigState, image_bytes: float) -> float:
    """Return what a recording of these streams writes at most: images that do not shrink when they are packed."""
    rates = {row.stream: row.rate_hz for row in state.rows if not math.isnan(row.rate_hz)}
    return sum(rate * _BYTES_PER_SAMPLE.get(stream, image_bytes) for stream, rate in rates.items())


def image_bytes(seen: Telemetry) -> float:
    """Return the size of one full image of the cameras, 0 where none has come."""
    return max((float(image.size) * IMAGE_STEP**2 for image in seen.images.values()), default=0.0)


class DiskWatch(QObject):
    """Looks how much room the folder of the sessions has, in a thread of its own; ``minutes_left`` tells it."""

    minutes_left = Signal(float)
    _measured = Signal(float)

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._bytes_per_s = 0.0
        self._image_bytes = 0.0
        self._measured.connect(self._tell)
        self._timer = QTimer(self, interval=_PERIOD_MS)
        self._timer.timeout.connect(self._look)
        self._timer.start()

    def take(self, seen: Telemetry, state: RigState) -> None:
        """See what the devices deliver."""
        self._image_bytes = max(self._image_bytes, image_bytes(seen))
        self._bytes_per_s = bytes_per_s(state, self._image_bytes)

    def _look(self) -> None:
        QThreadPool.globalInstance().start(_Look(self._folder, self._measured))

    def _tell(self, free: float) -> None:
        self.minutes_left.emit(free / self._bytes_per_s / 60.0 if self._bytes_per_s > 0.0 else math.nan)


class _Look(QRunnable):
    """Asks the file system, which may take its time on a network."""

    def __init__(self, folder: Path, measured: object) -> None:
        super().__init__()
        self._folder, self._measured = folder, measured

    def run(self) -> None:
        """Ask, at the nearest folder that exists."""
        there = next(path for path in (self._folder, *self._folder.absolute().parents) if path.exists())
        self._measured.emit(float(shutil.disk_usage(there).free))  # type: ignore[attr-defined] # a signal
