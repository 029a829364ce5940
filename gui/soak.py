"""The window for a long time at full load: how much memory it takes, how long it blocks, how fluently it shows.

The emulated devices run in processes of their own: force at 7 kHz, poses at 250 Hz, two cameras at 30 images a second.

Usage::

    python -m gui.soak --minutes 30 --output soak.png
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

from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtWidgets import QApplication

from daq.recording.streams import camera_stream
from daq.virtual_rig.load import Load, loaded_rig
from gui.app import Desk
from gui.rehearsal import wait_until
from gui.soak_meter import LONGEST_BLOCK_S, Meter, Second
from gui.soak_plot import plot_soak
from gui.theme import LIGHT, apply_theme
from robot_drivers.real_time import prefer_this_process, shorten_collections

_MOST_GROWTH_MIB = 50.0
_MOST_MORE_THREADS = _MOST_MORE_HANDLES = 4
_CAMERAS = 2
_SHOWN_PER_S = 30.0
_SHOWN_SHARE = 0.95
_FEWEST_REPAINTS = 20_000

Span = tuple[float, float, float]
"""Of a quantity: at the beginning, at the end, and at most."""


@dataclass(frozen=True, slots=True)
class SoakResult:
    """What a run measured, after its first tenth.

    Attributes
    ----------
    minutes : of measuring
    memory_mib : resident memory of the window's process
    threads, handles : of that process
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
    memory_mib: Span
    threads: Span
    handles: Span
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
        more = [ended - began for began, ended, _ in (self.memory_mib, self.threads, self.handles)]
        shown = all(
            rate >= _SHOWN_SHARE * min(self.received_per_s[camera_stream(camera)], _SHOWN_PER_S)
            for camera, rate in self.images_per_s.items()
        )
        return {
            f"memory grows by less than {_MOST_GROWTH_MIB:g} MiB": more[0] < _MOST_GROWTH_MIB,
            "neither threads nor handles pile up": more[1] <= _MOST_MORE_THREADS
            and more[2] <= _MOST_MORE_HANDLES,
            f"no block of {1e3 * LONGEST_BLOCK_S:g} ms": self.longest_block_s < LONGEST_BLOCK_S,
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
                f"  threads: {self.threads[0]:g}, then {self.threads[1]:g}; open files and sockets: "
                f"{self.handles[0]:g}, then {self.handles[1]:g}",
                f"  interface thread: longest block {1e3 * self.longest_block_s:.0f} ms, of which it worked "
                f"{1e3 * self.longest_work_s:.0f} ms at most; {self.blocks} blocks over 100 ms",
                f"  shown: telemetry {self.telemetry_per_s:.1f}/s, images {shown} /s; {self.repaints} repaints",
                f"  window's process: {100 * self.cpu_share:.0f} % of one core",
                *(f"  {'passed' if held else 'FAILED'}: {bar}" for bar, held in self.bars.items()),
            ]
        )


def run(
    minutes: float, folder: Path, load: Load, application: QApplication
) -> tuple[SoakResult, list[Second]]:
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
        shorten_collections()
        meter = Meter(application)
        link.telemetry.connect(meter.take)
        _wait(0.1 * minutes)
        meter.begin()
        first = _received(desk)
        _wait(minutes)
        elapsed_s = time.monotonic() - meter.began_s
        received = {name: (count - first[name]) / elapsed_s for name, count in _received(desk).items()}
        seconds, cpu_s = meter.seconds, time.process_time() - meter.began_cpu_s
        desk.end()
    images: Counter[str] = Counter()
    for second in seconds:
        images.update(second.images)
    result = SoakResult(
        minutes=elapsed_s / 60.0,
        memory_mib=_span([second.memory_mib for second in seconds]),
        threads=_span([second.threads for second in seconds]),
        handles=_span([second.handles for second in seconds]),
        longest_block_s=max(second.block_s for second in seconds),
        longest_work_s=max(second.work_s for second in seconds),
        blocks=sum(second.blocks for second in seconds),
        telemetry_per_s=sum(second.telemetry for second in seconds) / elapsed_s,
        images_per_s={name: count / elapsed_s for name, count in sorted(images.items())},
        repaints=sum(second.repaints for second in seconds),
        cpu_share=cpu_s / elapsed_s,
        load_average=os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"),
        received_per_s=received,
    )
    return result, seconds


def _span(values: Sequence[float]) -> Span:
    return (values[0], values[-1], max(values))


def _wait(minutes: float) -> None:
    """Let the event loop run as it does in the window; the application's own quit would close the window."""
    loop = QEventLoop()
    QTimer.singleShot(round(6e4 * minutes), loop.quit)
    loop.exec()


def _received(desk: Desk) -> dict[str, int]:
    assert desk.context is not None
    rows = desk.context.link.state.rows
    return {row.stream: row.counts.received for row in rows if row.counts is not None}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; exit status 1 when a bar did not hold. Twenty thousand repaints take two minutes."""
    parser = argparse.ArgumentParser(prog="python -m gui.soak", description=main.__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--rate", type=int, default=7000, help="of the force sensor, Hz")
    parser.add_argument("--frames", type=float, default=30.0, help="of each camera, 1/s")
    parser.add_argument("--output", type=Path, metavar="PNG", help="keep a picture of the whole time")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    options = parser.parse_args(arguments)
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    prefer_this_process()
    application = QApplication(sys.argv[:1])
    application.setQuitOnLastWindowClosed(False)
    apply_theme(application, LIGHT)
    with tempfile.TemporaryDirectory(prefix="soak-") as folder:
        load = Load(options.rate, options.frames)
        result, seconds = run(options.minutes, Path(folder), load, application)
    sys.stdout.write(f"{json.dumps(asdict(result)) if options.json else result}\n")
    if options.output is not None:
        plot_soak(seconds, options.output)
    return 0 if result.passed else 1


if __name__ == "__main__":
    sys.exit(main())
