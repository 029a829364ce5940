"""Recordings killed at random instants, to see whether every sample is there that was acknowledged before.

A process that records emulated devices tells a hundred times a second how many samples of each stream are written.
It is killed, the recording is recovered, and what is in it is compared with what the process had told last.

Usage::

    python -m daq.virtual_rig.kill_campaign --kills 100
"""

import argparse
import json
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from daq.devices import connected
from daq.errors import RecordingError
from daq.recording.folder import SessionInfo, write_info
from daq.recording.reader import Recording
from daq.recording.recorder import Recorder
from daq.recording.recovery import recover_session
from daq.rig import make_devices, read_rig
from daq.virtual_rig.load import Load, loaded_rig

_TELL_PERIOD_S = 0.01
_START_TIMEOUT_S = 60.0
_TRIES = 3


@dataclass(frozen=True, slots=True)
class Kill:
    """One killed recording.

    Attributes
    ----------
    after_s : from the first acknowledgement
    acknowledged, recovered : samples of each stream
    dropped_bytes : of incomplete messages that recovery left out
    intact : every counter without a gap, and the last image of each camera can be decoded
    """

    after_s: float
    acknowledged: dict[str, int]
    recovered: dict[str, int]
    dropped_bytes: int
    intact: bool

    @property
    def lost(self) -> int:
        """Acknowledged samples that are not there."""
        return sum(max(0, told - self.recovered[stream]) for stream, told in self.acknowledged.items())

    @property
    def passed(self) -> bool:
        """Whether all is there that ought to be."""
        return self.lost == 0 and self.intact

    def __str__(self) -> str:
        return (
            f"killed after {self.after_s:.3f} s: {sum(self.acknowledged.values())} acknowledged, "
            f"{sum(self.recovered.values())} recovered, {self.lost} lost, {self.dropped_bytes} bytes cut off"
            f"{'' if self.passed else '  FAILED'}"
        )


def campaign(kills: int, folder: Path, load: Load, longest_s: float = 2.0, seed: int = 0) -> Iterator[Kill]:
    """Kill so many recordings in ``folder``, an existing one, at instants from 0 to ``longest_s``."""
    chance = random.Random(seed)
    with loaded_rig(folder, load):
        for number in range(kills):
            yield kill_one(folder / "rig.toml", folder / f"session_{number}", chance.uniform(0.0, longest_s))


def kill_one(rig_path: Path, session: Path, after_s: float) -> Kill:
    """Record into a new folder in a process of its own, kill that, recover, compare, and remove the folder.

    Raises
    ------
    RecordingError
        The process cannot record; its own messages tell why.
    """
    for _ in range(_TRIES):
        told = _record_and_kill(rig_path, session, after_s)
        if told:
            break
    else:
        raise RecordingError("the recording process has acknowledged nothing; see its messages above")
    dropped_bytes = recover_session(session).left_out_bytes
    recovered, intact = _look(Recording(session))
    shutil.rmtree(session)
    return Kill(after_s, json.loads(told[-1]), recovered, dropped_bytes, intact)


def _record_and_kill(rig_path: Path, session: Path, after_s: float) -> list[str]:
    """Return the lines that the process told; none where the devices, still busy with the last one, refused it."""
    command = [sys.executable, "-m", "daq.virtual_rig.kill_campaign", "--record", str(rig_path), str(session)]
    told: list[str] = []
    heard = threading.Event()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        stdout = process.stdout
        assert stdout is not None

        def listen() -> None:
            for line in stdout:
                told.append(line)
                heard.set()
            heard.set()

        listener = threading.Thread(target=listen, name="acknowledgements")
        listener.start()
        if heard.wait(_START_TIMEOUT_S) and told:
            time.sleep(after_s)
        process.kill()
        listener.join()
    # a line that was cut off acknowledges nothing
    return [line for line in told if line.endswith("\n")]


def record(rig_path: Path, session: Path) -> None:
    """Record until killed, and tell on standard output what is written."""
    with connected(make_devices(read_rig(rig_path))) as devices:
        session.mkdir()
        write_info(session, SessionInfo("killed", "none", 1))
        devices.force_sensor.start()
        with Recorder(session, devices) as recorder:
            while True:
                recorder.check()
                sys.stdout.write(f"{json.dumps(recorder.written())}\n")
                sys.stdout.flush()
                time.sleep(_TELL_PERIOD_S)


def _look(recording: Recording) -> tuple[dict[str, int], bool]:
    """Return the samples of each stream, and whether none is missing between the first and the last of them."""
    counters = {"force": recording.force.counter, "robot": recording.robot.counter}
    intact = True
    for name in recording.cameras:
        images = recording.images(name)
        counters[f"camera/{name}"] = images.counter
        if len(images):
            intact = intact and images.image(len(images) - 1).ndim == 2
    for stream in ("force", "robot"):
        intact = intact and bool(np.all(np.diff(counters[stream]) == 1))
    return {stream: len(counter) for stream, counter in counters.items()}, intact


def summary(kills: Sequence[Kill]) -> str:
    """Return one line for all."""
    passed, lost = sum(kill.passed for kill in kills), sum(kill.lost for kill in kills)
    return f"{passed} of {len(kills)} kills left everything that was acknowledged; {lost} samples lost"


def main(arguments: Sequence[str] | None = None) -> int:
    """Kill recordings at random instants and look what is left; exit status 1 when anything is missing."""
    parser = argparse.ArgumentParser(prog="python -m daq.virtual_rig.kill_campaign", description=main.__doc__)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the instants")
    parser.add_argument("--rate", type=int, default=7000, help="of the force sensor, Hz")
    parser.add_argument("--frames", type=float, default=25.0, help="of each camera, 1/s")
    parser.add_argument("--folder", type=Path, help="where to record (default: the temporary folder)")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    parser.add_argument("--record", nargs=2, type=Path, metavar=("RIG", "SESSION"), help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.record is not None:
        record(*options.record)
    kills = []
    with tempfile.TemporaryDirectory(prefix="kills-", dir=options.folder) as folder:
        for kill in campaign(
            options.kills, Path(folder), Load(options.rate, options.frames), seed=options.seed
        ):
            kills.append(kill)
            if not options.json:
                sys.stdout.write(f"{kill}\n")
                sys.stdout.flush()
    passed = all(kill.passed for kill in kills)
    said = json.dumps({"kills": [asdict(kill) for kill in kills], "passed": passed})
    sys.stdout.write(f"{said if options.json else summary(kills)}\n")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
