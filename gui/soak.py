"""The window for a long time at full load: how much memory it takes, how long it blocks, how fluently it shows.

The emulated devices run in processes of their own: force at 7 kHz, poses at 250 Hz, two cameras at 30 images a second.

Usage::

    python -m gui.soak --minutes 30
"""

import argparse
import json
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from PySide6.QtCore import QEvent, QEventLoop, QObject, Qt, QTimer
from PySide6.QtWidgets import QApplication

from daq.acquisition.messages import Telemetry
from daq.recording.streams import camera_stream
from daq.virtual_rig.load import Load, loaded_rig
from gui.app import Desk
from gui.rehearsal import wait_until
from gui.theme import LIGHT, apply_theme
from robot_drivers.real_time import prefer_this_process

_TICK_MS = 5
_MEMORY_MS = 1000
_MIB = 2**20
_LONGEST_BLOCK_S = 0.1
_MOST_GROWTH_MIB = 50.0
_CAMERAS = 2
_SHOWN_PER_S = 30.0
_SHOWN_SHARE = 0.95
_FEWEST_REPAINTS = 20_000


@dataclass(frozen=True, slots=True)
class SoakResult:
    """What a run measured, after its first tenth.

    Attributes
    ----------
    minutes : of measuring
    memory_mib : resident memory of the window's process at the beginning and at the end, and at most
    longest_block_s : between two ticks of the interface thread, beyond the tick
    longest_work_s : processor time of the interface thread between two ticks; less than the block where others had
        the processor
    blocks : times that the interface thread was blocked for longer than 100 ms
    telemetry_per_s, images_per_s : shown, images of each camera
    repaints : of all widgets
    cpu_share : of the window's process, of one core
    load_average : of the machine, over the last minute
    received_per_s : samples of each stream
    """

    minutes: float
    memory_mib: tuple[float, float, float]
    longest_block_s: float
    longest_work_s: float
    blocks: int
    telemetry_per_s: float
    images_per_s: dict[str, float]
    repaints: int
    cpu_share: float
    load_average: float
    received_per_s: dict[str, float]

    @property
    def bars(self) -> dict[str, bool]:
        """What it is held to, in words, and whether it held.

        Of the images as many must be shown as the cameras delivered, but for one in twenty, up to 30 a second.
        """
        began, ended, _ = self.memory_mib
        shown = all(
            rate >= _SHOWN_SHARE * min(self.received_per_s[camera_stream(camera)], _SHOWN_PER_S)
            for camera, rate in self.images_per_s.items()
        )
        return {
            f"memory grows by less than {_MOST_GROWTH_MIB:g} MiB": ended - began < _MOST_GROWTH_MIB,
            f"no block of {1e3 * _LONGEST_BLOCK_S:g} ms": self.longest_block_s < _LONGEST_BLOCK_S,
            f"both cameras shown as they deliver, up to {_SHOWN_PER_S:g}/s": shown
            and len(self.images_per_s) == _CAMERAS,
            f"{_FEWEST_REPAINTS} repaints": self.repaints >= _FEWEST_REPAINTS,
        }

    @property
    def passed(self) -> bool:
        """Whether every bar held."""
        return all(self.bars.values())

    def __str__(self) -> str:
        began, ended, most = self.memory_mib
        shown = ", ".join(f"{name} {rate:.1f}" for name, rate in self.images_per_s.items())
        received = ", ".join(f"{name} {rate:.0f}/s" for name, rate in self.received_per_s.items())
        return "\n".join(
            [
                f"{self.minutes:.1f} min, load of the machine {self.load_average:.1f}, received {received}",
                f"  memory: {began:.1f} MiB, then {ended:.1f} MiB ({ended - began:+.1f}), at most {most:.1f} MiB",
                f"  interface thread: longest block {1e3 * self.longest_block_s:.0f} ms, of which it worked "
                f"{1e3 * self.longest_work_s:.0f} ms at most; {self.blocks} blocks over 100 ms",
                f"  shown: telemetry {self.telemetry_per_s:.1f}/s, images {shown} /s; {self.repaints} repaints",
                f"  window's process: {100 * self.cpu_share:.0f} % of one core",
                *(f"  {'passed' if held else 'FAILED'}: {bar}" for bar, held in self.bars.items()),
            ]
        )


class Meter(QObject):
    """Measures the interface thread and what is shown, from :meth:`begin` on."""

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        self._tick = QTimer(self, interval=_TICK_MS, timerType=Qt.TimerType.PreciseTimer)
        self._tick.timeout.connect(self._on_tick)
        self._look = QTimer(self, interval=_MEMORY_MS)
        self._look.timeout.connect(self._on_look)
        application.installEventFilter(self)
        self.begin()

    def begin(self) -> None:
        """Forget what was measured and begin anew."""
        self.longest_block_s = self.longest_work_s = 0.0
        self.blocks = self.telemetry = self.repaints = 0
        self.images: Counter[str] = Counter()
        self.memory_mib = [_memory_mib()]
        self.began_s, self.began_cpu_s = time.monotonic(), time.process_time()
        self._last_s, self._last_work_s = self.began_s, time.thread_time()
        self._tick.start()
        self._look.start()

    def take(self, seen: Telemetry) -> None:
        """Count what is shown."""
        self.telemetry += 1
        self.images.update(list(seen.images))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Count the repaints."""
        if event.type() == QEvent.Type.Paint:
            self.repaints += 1
        return False

    def _on_tick(self) -> None:
        now_s, work_s = time.monotonic(), time.thread_time()
        block_s = now_s - self._last_s - 1e-3 * _TICK_MS
        self.longest_block_s = max(self.longest_block_s, block_s)
        self.longest_work_s = max(self.longest_work_s, work_s - self._last_work_s)
        self.blocks += block_s > _LONGEST_BLOCK_S
        self._last_s, self._last_work_s = now_s, work_s

    def _on_look(self) -> None:
        self.memory_mib.append(_memory_mib())


def run(minutes: float, folder: Path, load: Load, application: QApplication) -> SoakResult:
    """Show the Acquire page over emulated devices for so long, plus a tenth before it is measured."""
    with loaded_rig(folder, load) as running:
        desk = Desk(running.rig, folder / "sessions")
        desk.open()
        assert desk.window is not None
        assert desk.context is not None
        link = desk.context.link
        link.open(running.rig)
        wait_until(lambda: link.state.phase == "ready", "a connected rig", 120.0)
        desk.window.show_page("Acquire")
        meter = Meter(application)
        link.telemetry.connect(meter.take)
        _wait(0.1 * minutes)
        meter.begin()
        first = _received(desk)
        _wait(minutes)
        seconds = time.monotonic() - meter.began_s
        received = {name: (count - first[name]) / seconds for name, count in _received(desk).items()}
        result = SoakResult(
            seconds / 60.0,
            (meter.memory_mib[0], meter.memory_mib[-1], max(meter.memory_mib)),
            meter.longest_block_s,
            meter.longest_work_s,
            meter.blocks,
            meter.telemetry / seconds,
            {name: count / seconds for name, count in sorted(meter.images.items())},
            meter.repaints,
            (time.process_time() - meter.began_cpu_s) / seconds,
            os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"),
            received,
        )
        desk.end()
    return result


def _wait(minutes: float) -> None:
    """Let the event loop run as it does in the window; the application's own quit would close the window."""
    loop = QEventLoop()
    QTimer.singleShot(round(6e4 * minutes), loop.quit)
    loop.exec()


def _received(desk: Desk) -> dict[str, int]:
    assert desk.context is not None
    rows = desk.context.link.state.rows
    return {row.stream: row.counts.received for row in rows if row.counts is not None}


def _memory_mib() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1]) if sys.platform == "linux" else 0
    return pages * 4096 / _MIB


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; exit status 1 when a bar did not hold. Twenty thousand repaints take two minutes."""
    parser = argparse.ArgumentParser(prog="python -m gui.soak", description=main.__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--rate", type=int, default=7000, help="of the force sensor, Hz")
    parser.add_argument("--frames", type=float, default=30.0, help="of each camera, 1/s")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    options = parser.parse_args(arguments)
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    prefer_this_process()
    application = QApplication(sys.argv[:1])
    application.setQuitOnLastWindowClosed(False)
    apply_theme(application, LIGHT)
    with tempfile.TemporaryDirectory(prefix="soak-") as folder:
        result = run(options.minutes, Path(folder), Load(options.rate, options.frames), application)
    sys.stdout.write(f"{json.dumps(asdict(result)) if options.json else result}\n")
    return 0 if result.passed else 1


if __name__ == "__main__":
    sys.exit(main())
