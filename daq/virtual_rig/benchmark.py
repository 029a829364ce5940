"""How much of a processor the acquisition needs at full load, and whether it loses anything.

The emulated devices run in processes of their own; this process does what the acquisition process does: it reads
them, guards, shows and records. In the end the force leaps beyond its limit, and the guard's reaction is measured.
All of them go before other programs where the system grants it.

Usage::

    python -m daq.virtual_rig.benchmark --seconds 600
"""

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from daq.acquisition.live_view import LiveView
from daq.devices import connected
from daq.recording.folder import SessionInfo, seal_session, write_info
from daq.recording.reader import Recording
from daq.recording.recorder import Recorder
from daq.rig import make_devices
from daq.session.guard import Guard
from daq.virtual_rig.load import Load, LoadedRig, loaded_rig
from robot_drivers.protocols import IntArray
from robot_drivers.real_time import prefer_this_process, shorten_collections, shorten_turns

_REST_S = 0.5
_LOOK_PERIOD_S = 0.2
_PATIENCE_S = 5.0
_MIB = 2**20


@dataclass(frozen=True, slots=True)
class StreamResult:
    """One stream: samples in the file, and how many the device's own counter misses between first and last."""

    recorded: int
    missing: int
    raw: int = 0


@dataclass(frozen=True, slots=True)
class BenchmarkResult:
    """What a run measured.

    Attributes
    ----------
    seconds : of recording
    streams : by name
    lost, dropped : by the drivers' and the recorder's own counts
    cpu_share : of this process, of one core, while it recorded
    load_average : of the machine, over the last minute of the run
    memory_mib : resident memory after a tenth of the run, at the end, and at most
    bytes_per_s : written
    sealing_s : from the last sample to the sealed session, with its checksums
    guard_latency_s : median, 99.9 % and longest, from the oldest sample's stamp to the end of its check
    reaction_s : from the sample beyond the limit to the stop command; None when it was never held
    """

    seconds: float
    streams: dict[str, StreamResult]
    lost: int
    dropped: int
    cpu_share: float
    load_average: float
    memory_mib: tuple[float, float, float]
    bytes_per_s: float
    sealing_s: float
    guard_latency_s: tuple[float, float, float]
    reaction_s: float | None

    @property
    def complete(self) -> bool:
        """Whether nothing is missing."""
        return not (self.lost or self.dropped or any(stream.missing for stream in self.streams.values()))

    def __str__(self) -> str:
        lines = [f"{self.seconds:.0f} s, load of the machine {self.load_average:.1f}"]
        for name, stream in self.streams.items():
            raw = f", {stream.raw} of them raw" if stream.raw else ""
            lines.append(f"  {name:14} {stream.recorded:9d} recorded{raw}, {stream.missing} missing")
        early, late, most = self.memory_mib
        median, nearly_all, longest = (1e3 * value for value in self.guard_latency_s)
        reaction = "never held" if self.reaction_s is None else f"{self.reaction_s * 1e3:.1f} ms"
        lines += [
            f"  lost by the drivers {self.lost}, dropped by the recorder {self.dropped}",
            f"  acquisition process: {100 * self.cpu_share:.0f} % of one core",
            f"  resident memory: {early:.0f} MiB early, {late:.0f} MiB in the end, {most:.0f} MiB at most",
            f"  written: {self.bytes_per_s / _MIB:.1f} MiB/s; sealed in {self.sealing_s:.1f} s",
            f"  guard: a sample was checked after {median:.1f} ms (median), {nearly_all:.1f} ms (99.9 %), "
            f"{longest:.1f} ms at most; stop sent {reaction} after the sample beyond the limit",
        ]
        return "\n".join(lines)


@dataclass(slots=True)
class _Memory:
    """Resident memory of this process, MiB."""

    samples: list[float] = field(default_factory=list)

    def sample(self) -> None:
        pages = int(Path("/proc/self/statm").read_text().split()[1]) if sys.platform == "linux" else 0
        self.samples.append(pages * 4096 / _MIB)

    def summary(self) -> tuple[float, float, float]:
        return self.samples[len(self.samples) // 10], self.samples[-1], max(self.samples)


def run(seconds: float, folder: Path, load: Load) -> BenchmarkResult:
    """Record emulated devices for ``seconds`` into a session in ``folder``, an existing one."""
    with loaded_rig(folder, load) as running:
        return _record(running, folder / "session", seconds)


def _record(running: LoadedRig, session: Path, seconds: float) -> BenchmarkResult:
    session.mkdir()
    write_info(session, SessionInfo("benchmark", "none", 1))
    rig = running.rig
    memory = _Memory()
    with connected(make_devices(rig)) as devices:
        shorten_collections()
        devices.force_sensor.start()
        guard = Guard(rig.limits, rig.frames, devices.robot)
        began_s, began_cpu_s = time.monotonic(), time.process_time()
        with Recorder(session, devices, (guard, LiveView())) as recorder:
            guard.watch_rest()
            time.sleep(_REST_S)
            guard.arm()
            while time.monotonic() < began_s + seconds:
                memory.sample()
                recorder.check()
                time.sleep(_LOOK_PERIOD_S)
            seconds = time.monotonic() - began_s
            cpu_share = (time.process_time() - began_cpu_s) / seconds
            running.overload()
            while guard.stop is None and time.monotonic() < began_s + seconds + _PATIENCE_S:
                time.sleep(_LOOK_PERIOD_S)
        lost = sum(device.statistics().lost for device in devices.all().values())
    sealing_s = time.monotonic()
    seal_session(session)
    sealing_s = time.monotonic() - sealing_s
    size = sum(path.stat().st_size for path in session.glob("*.mcap"))
    latency = guard.latency
    return BenchmarkResult(
        seconds,
        _streams(Recording(session)),
        lost,
        sum(recorder.dropped().values()),
        cpu_share,
        os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"),
        memory.summary(),
        size / seconds,
        sealing_s,
        (latency.quantile_s(0.5), latency.quantile_s(0.999), latency.longest_s),
        None if guard.stop is None else guard.stop.reaction_s,
    )


def _streams(recording: Recording) -> dict[str, StreamResult]:
    streams = {
        "force": StreamResult(len(recording.force), _missing(recording.force.counter)),
        "robot": StreamResult(len(recording.robot), _missing(recording.robot.counter)),
    }
    for name in recording.cameras:
        images = recording.images(name)
        raw = sum(images.is_raw(index) for index in range(len(images)))
        streams[f"camera {name}"] = StreamResult(len(images), _missing(images.counter), raw)
    return streams


def _missing(counter: IntArray) -> int:
    return int(counter[-1] - counter[0] + 1 - len(np.unique(counter)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the acquisition against emulated devices; exit status 1 when anything is missing."""
    parser = argparse.ArgumentParser(prog="python -m daq.virtual_rig.benchmark", description=main.__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rate", type=int, default=7000, help="of the force sensor, Hz")
    parser.add_argument("--frames", type=float, default=25.0, help="of each camera, 1/s")
    parser.add_argument("--colour", action="store_true", help="cameras with a Bayer mosaic")
    parser.add_argument(
        "--folder", type=Path, help="where to record, 30 MB/s (default: the temporary folder)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    options = parser.parse_args(arguments)
    load = Load(options.rate, options.frames, options.colour)
    prefer_this_process()
    shorten_turns()
    with tempfile.TemporaryDirectory(prefix="benchmark-", dir=options.folder) as folder:
        result = run(options.seconds, Path(folder), load)
    sys.stdout.write(f"{json.dumps(asdict(result)) if options.json else result}\n")
    return 0 if result.complete else 1


if __name__ == "__main__":
    sys.exit(main())
