"""What a soak measures, second by second, while the window runs: memory, threads, handles, latencies, what is shown."""

import math
import os
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QApplication

from daq.acquisition.messages import Telemetry
from robot_drivers.clock import host_time_ns

LONGEST_BLOCK_S = 0.1

_TICK_MS = 5
_SECOND_MS = 1000
_MIB = 2**20
_PROCESSES = Path("/proc")
_RECORDER = b"daq.acquisition"


@dataclass(frozen=True, slots=True)
class Resources:
    """What a process holds; NaN where the system does not tell, or the process is gone.

    Attributes
    ----------
    memory_mib : resident and its own, without the files that it has mapped
    threads, handles : handles are open files and sockets
    """

    memory_mib: float = math.nan
    threads: float = math.nan
    handles: float = math.nan


@dataclass(frozen=True, slots=True)
class Second:
    """What one second was like.

    Attributes
    ----------
    time_s : its end, since the measurement began
    duration_s : about one, longer where the interface thread was blocked
    window, recorder : what both processes held at its end
    window_late_s : from the recorder's telling something until the window had it, at most; NaN where it told nothing
    recorder_late_s : from the arrival of the newest sample of the force sensor that was told until that was told, at
        most; NaN likewise
    block_s : the longest time that the interface thread did not take an event
    work_s : the most processor time that it spent between two of them; less than the block where others took it
    blocks : longer than 100 ms
    telemetry, repaints : shown, painted
    images : of each camera, shown
    received : samples of each stream
    """

    time_s: float
    duration_s: float
    window: Resources
    recorder: Resources
    window_late_s: float
    recorder_late_s: float
    block_s: float
    work_s: float
    blocks: int
    telemetry: int
    repaints: int
    images: dict[str, int]
    received: dict[str, int]


class Meter(QObject):
    """Measures from :meth:`begin` on; ``measured`` brings every second.

    Attributes
    ----------
    began_s, began_cpu_s : time and the process's processor time at the beginning
    """

    measured = Signal(object)

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        self._recorder = _recorder_of(os.getpid())
        self._counted: dict[str, int] = {}
        self._tick = QTimer(self, interval=_TICK_MS, timerType=Qt.TimerType.PreciseTimer)
        self._tick.timeout.connect(self._on_tick)
        self._look = QTimer(self, interval=_SECOND_MS)
        self._look.timeout.connect(self._on_second)
        application.installEventFilter(self)
        self.begin()

    def begin(self) -> None:
        """Forget what was measured and begin anew."""
        self.began_s, self.began_cpu_s = time.monotonic(), time.process_time()
        self._last_s, self._last_work_s = self.began_s, time.thread_time()
        self._second_began_s = self.began_s
        self._forget()
        self._tick.start()
        self._look.start()

    def take(self, seen: Telemetry) -> None:
        """Count what is shown, and how late it is."""
        self._telemetry += 1
        self._images.update(list(seen.images))
        for stream, counts in seen.counts.items():
            before, self._counted[stream] = self._counted.get(stream, 0), counts.received
            # a device that begins to stream anew counts from zero
            self._received[stream] += counts.received - (before if before <= counts.received else 0)
        self._window_late_s.append((host_time_ns() - seen.time_ns) * 1e-9)
        if len(seen.force):
            self._recorder_late_s.append(seen.time_ns * 1e-9 - float(seen.force[-1, 0]))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Count the repaints."""
        if event.type() == QEvent.Type.Paint:
            self._repaints += 1
        return False

    def _forget(self) -> None:
        self._block_s = self._work_s = 0.0
        self._blocks = self._telemetry = self._repaints = 0
        self._images: Counter[str] = Counter()
        self._received: Counter[str] = Counter()
        self._window_late_s: list[float] = []
        self._recorder_late_s: list[float] = []

    def _on_tick(self) -> None:
        now_s, work_s = time.monotonic(), time.thread_time()
        block_s = now_s - self._last_s - 1e-3 * _TICK_MS
        self._block_s = max(self._block_s, block_s)
        self._work_s = max(self._work_s, work_s - self._last_work_s)
        self._blocks += block_s > LONGEST_BLOCK_S
        self._last_s, self._last_work_s = now_s, work_s

    def _on_second(self) -> None:
        now_s = time.monotonic()
        second = Second(
            now_s - self.began_s,
            now_s - self._second_began_s,
            resources_of(os.getpid()),
            resources_of(self._recorder),
            max(self._window_late_s, default=float("nan")),
            max(self._recorder_late_s, default=float("nan")),
            self._block_s,
            self._work_s,
            self._blocks,
            self._telemetry,
            self._repaints,
            dict(self._images),
            dict(self._received),
        )
        self._second_began_s = now_s
        self._forget()
        self.measured.emit(second)


def resources_of(process: int | None) -> Resources:
    """Return what a process holds."""
    if sys.platform != "linux" or process is None:
        return Resources()
    own = _PROCESSES / str(process)
    try:
        _, resident, shared, *_ = map(int, (own / "statm").read_text().split())
        threads, handles = (sum(1 for _ in (own / entries).iterdir()) for entries in ("task", "fd"))
    except OSError:  # it is gone, which NaN tells
        return Resources()
    return Resources((resident - shared) * os.sysconf("SC_PAGE_SIZE") / _MIB, threads, handles)


def _recorder_of(window: int) -> int | None:
    """Return the process that records for a window, None where the system does not tell."""
    if sys.platform != "linux":
        return None
    for thread in (_PROCESSES / str(window) / "task").iterdir():
        for child in (thread / "children").read_text().split():
            if _RECORDER in (_PROCESSES / child / "cmdline").read_bytes():
                return int(child)
    return None
