"""What a soak measures, second by second, while the window runs: blocks, repaints, images, memory, threads, handles."""

import sys
import threading
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtWidgets import QApplication

from daq.acquisition.messages import Telemetry

LONGEST_BLOCK_S = 0.1

_TICK_MS = 5
_SECOND_MS = 1000
_MIB = 2**20
_PROCESS = Path("/proc/self")


@dataclass(frozen=True, slots=True)
class Second:
    """What one second was like.

    Attributes
    ----------
    time_s : its end, since the measurement began
    duration_s : about one, longer where the interface thread was blocked
    memory_mib : resident memory of the window's process at its end
    threads, handles : of the process at its end; 0 handles where the system does not tell them
    block_s : the longest time that the interface thread did not take an event
    work_s : the most processor time that it spent between two of them; less than the block where others took it
    blocks : longer than 100 ms
    telemetry, repaints : shown, painted
    images : of each camera, shown
    """

    time_s: float
    duration_s: float
    memory_mib: float
    threads: int
    handles: int
    block_s: float
    work_s: float
    blocks: int
    telemetry: int
    repaints: int
    images: dict[str, int]


class Meter(QObject):
    """Measures from :meth:`begin` on.

    Attributes
    ----------
    seconds : measured so far
    began_s, began_cpu_s : time and the process's processor time at the beginning
    """

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        self._tick = QTimer(self, interval=_TICK_MS, timerType=Qt.TimerType.PreciseTimer)
        self._tick.timeout.connect(self._on_tick)
        self._look = QTimer(self, interval=_SECOND_MS)
        self._look.timeout.connect(self._on_second)
        application.installEventFilter(self)
        self.begin()

    def begin(self) -> None:
        """Forget what was measured and begin anew."""
        self.seconds: list[Second] = []
        self.began_s, self.began_cpu_s = time.monotonic(), time.process_time()
        self._last_s, self._last_work_s = self.began_s, time.thread_time()
        self._second_began_s = self.began_s
        self._forget()
        self._tick.start()
        self._look.start()

    def take(self, seen: Telemetry) -> None:
        """Count what is shown."""
        self._telemetry += 1
        self._images.update(list(seen.images))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Count the repaints."""
        if event.type() == QEvent.Type.Paint:
            self._repaints += 1
        return False

    def _forget(self) -> None:
        self._block_s = self._work_s = 0.0
        self._blocks = self._telemetry = self._repaints = 0
        self._images: Counter[str] = Counter()

    def _on_tick(self) -> None:
        now_s, work_s = time.monotonic(), time.thread_time()
        block_s = now_s - self._last_s - 1e-3 * _TICK_MS
        self._block_s = max(self._block_s, block_s)
        self._work_s = max(self._work_s, work_s - self._last_work_s)
        self._blocks += block_s > LONGEST_BLOCK_S
        self._last_s, self._last_work_s = now_s, work_s

    def _on_second(self) -> None:
        now_s = time.monotonic()
        self.seconds.append(
            Second(
                now_s - self.began_s,
                now_s - self._second_began_s,
                memory_mib(),
                _count("task") or threading.active_count(),
                _count("fd"),
                self._block_s,
                self._work_s,
                self._blocks,
                self._telemetry,
                self._repaints,
                dict(self._images),
            )
        )
        self._second_began_s = now_s
        self._forget()


def memory_mib() -> float:
    """Return the resident memory of this process; 0 where the system does not tell it."""
    pages = int((_PROCESS / "statm").read_text().split()[1]) if sys.platform == "linux" else 0
    return pages * 4096 / _MIB


def _count(entries: str) -> int:
    """Return how many threads ("task") or open files ("fd") this process has; 0 where the system does not tell them."""
    return sum(1 for _ in (_PROCESS / entries).iterdir()) if sys.platform == "linux" else 0
