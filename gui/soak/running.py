"""The window for a long time at full load: whether memory, threads, handles and latencies stay flat, and it fluent.

The emulated devices run in processes of their own: force at 7 kHz, poses at 250 Hz, two cameras at 30 images a second.
One pull after the other is recorded and sealed; what the one before has written is deleted, for an hour would fill a
hundred gigabytes.

Usage::

    python -m gui.soak --minutes 120 --output soak

``soak`` then holds ``seconds.csv``, which grows every second and so survives whatever ends the run, ``soak.png``, and
``soak.txt`` with the table and the verdict. An interrupted run ends with those of the time that it had.
"""

import argparse
import json
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QEventLoop, QObject, QTimer
from PySide6.QtWidgets import QApplication

from daq.acquisition.failures import Failure
from daq.acquisition.messages import Ended
from daq.session.session import Label
from daq.trajectories import PULL
from daq.virtual_rig.load import Load, loaded_rig
from gui.app import Desk
from gui.rehearsal import application_without_display, wait_until
from gui.rig.link import AcquisitionLink
from gui.soak.log import SoakLog
from gui.soak.meter import Meter
from gui.soak.plot import plot_soak
from gui.soak.result import SoakResult, images_shown_per_s
from gui.soak.series import series_of
from gui.theme import LIGHT
from robot_drivers.real_time import shorten_collections

_INTERRUPTED = 1


class SessionAfterSession(QObject):
    """Records one pull after the other, and deletes what the one before has written.

    Attributes
    ----------
    recorded : sessions that ended well
    troubles : why others did not; after one of them nothing more is recorded, for the robot is held
    """

    def __init__(self, link: AcquisitionLink, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._link = link
        self._folder = folder
        self.recorded = 0
        self.troubles: list[str] = []
        link.ended.connect(self._on_ended)
        link.refused.connect(self._on_refused)
        self._begin()

    def _begin(self) -> None:
        self._running = self._folder / f"pull_{self.recorded + 1}"
        self._link.start(PULL.trajectory(), self._running, Label(self._running.name))

    def _on_ended(self, ended: Ended) -> None:
        if ended.failure is not None:
            self.troubles.append(ended.failure.message)
            return
        self.recorded += 1
        # a gigabyte takes the disk some time
        threading.Thread(target=shutil.rmtree, args=(self._running,), name="delete").start()
        self._begin()

    def _on_refused(self, failure: Failure) -> None:
        self.troubles.append(failure.message)


def run(
    minutes: float, folder: Path, load: Load, application: QApplication, log: SoakLog
) -> SoakResult | None:
    """Show the Acquire page over emulated devices that are recorded, for a tenth of the time, then measure.

    An interrupt, from the keyboard or by the system, ends the measurement, not the program. Returns None where there
    was no measurement yet.
    """
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
        sessions = SessionAfterSession(link, folder / "sessions", desk)
        warm = _wait(0.1 * minutes)
        meter.measured.connect(log.add)
        meter.begin()
        if warm:
            _wait(minutes)
        elapsed_s = time.monotonic() - meter.began_s
        cpu_s = time.process_time() - meter.began_cpu_s
        recorded, troubles = sessions.recorded, tuple(sessions.troubles)
        desk.end()
    if not log.seconds:
        return None
    received: Counter[str] = Counter()
    for second in log.seconds:
        received.update(second.received)
    return SoakResult(
        minutes=elapsed_s / 60.0,
        wanted_minutes=minutes,
        series=series_of(log.seconds),
        sessions=recorded,
        troubles=troubles,
        longest_block_s=max(second.block_s for second in log.seconds),
        longest_work_s=max(second.work_s for second in log.seconds),
        blocks=sum(second.blocks for second in log.seconds),
        telemetry_per_s=sum(second.telemetry for second in log.seconds) / elapsed_s,
        images_per_s=images_shown_per_s(log.seconds),
        repaints=sum(second.repaints for second in log.seconds),
        cpu_share=cpu_s / elapsed_s,
        load_average=os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"),
        received_per_s={name: count / elapsed_s for name, count in sorted(received.items())},
    )


def _wait(minutes: float) -> bool:
    """Let the event loop run as it does in the window, for so long or until an interrupt; return whether none came.

    The application's own quit would close the window.
    """
    loop = QEventLoop()
    QTimer.singleShot(round(6e4 * minutes), loop.quit)
    signals = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: loop.exit(_INTERRUPTED)) for number in signals]
    try:
        return loop.exec() != _INTERRUPTED
    finally:
        for number, handler in zip(signals, before, strict=True):
            signal.signal(number, handler)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; exit status 1 when a bar did not hold. Twenty thousand repaints take two minutes."""
    parser = argparse.ArgumentParser(prog="python -m gui.soak", description=main.__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--rate", type=int, default=7000, help="of the force sensor, Hz")
    parser.add_argument("--frames", type=float, default=30.0, help="of each camera, 1/s")
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help="a new folder for seconds.csv, soak.png and soak.txt"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    options = parser.parse_args(arguments)
    with (
        application_without_display(LIGHT) as application,
        tempfile.TemporaryDirectory(prefix="soak-") as scratch,
    ):
        output = options.output or Path(scratch) / "soak"
        try:
            output.mkdir(parents=True)
        except OSError as error:
            sys.stderr.write(f"gui.soak: {output}: {error.strerror}; name a new folder\n")
            return 2
        with SoakLog(output / "seconds.csv") as log:
            result = run(options.minutes, Path(scratch), Load(options.rate, options.frames), application, log)
        if result is None:
            sys.stderr.write("gui.soak: interrupted before it measured; start it again\n")
            return 2
        plot_soak(log.seconds, output / "soak.png")
        (output / "soak.txt").write_text(f"{result}\n", encoding="utf-8")
    sys.stdout.write(f"{json.dumps(result.as_json()) if options.json else result}\n")
    return 0 if result.passed else 1
