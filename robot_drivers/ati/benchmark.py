"""How much of a processor the Net F/T driver needs; the emulator it reads runs in a process of its own.

Usage::

    python -m robot_drivers.ati.benchmark --rate 7000 --seconds 10
"""

import argparse
import contextlib
import multiprocessing
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np

from robot_drivers.ati.emulator import EmulatorSettings, NetFTEmulator
from robot_drivers.ati.netft import NetFT, NetFTSettings
from robot_drivers.protocols import StreamStatistics


@dataclass(frozen=True, slots=True)
class BenchmarkResult:
    """What a run measured; ``cpu_share`` is the driver's, of one core."""

    seconds: float
    statistics: StreamStatistics
    cpu_share: float

    def __str__(self) -> str:
        counts = self.statistics
        return (
            f"{counts.received / self.seconds:.1f} records/s over {self.seconds:.1f} s: "
            f"{counts.received} received, {counts.lost} lost, {counts.duplicated} duplicated, "
            f"{counts.late} late, {counts.malformed} malformed; "
            f"driver {100 * self.cpu_share:.1f} % of one core"
        )


def run(rate_hz: int, seconds: float) -> BenchmarkResult:
    """Read an emulated box at ``rate_hz`` for ``seconds``."""
    with _emulator() as (rdt_port, http_port):
        settings = NetFTSettings(host="127.0.0.1", rdt_port=rdt_port, http_port=http_port, rate_hz=rate_hz)
        with closing(NetFT(settings)) as sensor:
            sensor.connect()
            sensor.start()
            begin_s, begin_cpu_s = time.monotonic(), time.process_time()
            while (elapsed_s := time.monotonic() - begin_s) < seconds:
                sensor.read(timeout_s=0.1)
            cpu_share = (time.process_time() - begin_cpu_s) / elapsed_s
            return BenchmarkResult(elapsed_s, sensor.statistics(), cpu_share)


@contextmanager
def _emulator() -> Iterator[tuple[int, int]]:
    """Run the emulator in a process of its own; give its RDT and web ports."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_emulate, args=(there,), daemon=True)
    process.start()
    there.close()
    try:
        yield here.recv()
    finally:
        here.close()
        process.join()


def _emulate(told: Connection) -> None:
    """Tell the ports of an emulated box, which ends when the other side has gone."""
    with NetFTEmulator(lambda _time_s: np.zeros(6), EmulatorSettings()) as box:
        told.send((box.rdt_port, box.http_port))
        with contextlib.suppress(EOFError):
            told.recv()


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the driver against an emulated sensor; exit status 1 when a record was lost."""
    parser = argparse.ArgumentParser(prog="python -m robot_drivers.ati.benchmark", description=main.__doc__)
    parser.add_argument("--rate", type=int, default=7000, help="RDT rate, Hz")
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args(arguments)
    result = run(options.rate, options.seconds)
    sys.stdout.write(f"{result}\n")
    return 1 if result.statistics.lost else 0


if __name__ == "__main__":
    sys.exit(main())
