"""``retract replay``: play a session through the interfaces of the live devices."""

import argparse
import sys
from pathlib import Path

import numpy as np

from daq.cli.verb import Result, Verbs, add_verb
from daq.devices import Devices
from daq.recording.reader import open_recording
from daq.replay import ReplayClock, replayed

_EXAMPLES = """  retract replay sessions/2026-05-04_143210_P07_pull
  retract replay sessions/2026-05-04_143210_P07_pull --speed 5 --from 12.5"""

_LINE_S = 0.2


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "replay", "play a session as if its devices were there", _EXAMPLES, run)
    parser.add_argument("session", type=Path, metavar="SESSION", help="session folder")
    parser.add_argument(
        "--speed", type=float, default=1.0, metavar="FACTOR", help="times real time (default: %(default)s)"
    )
    parser.add_argument(
        "--from",
        dest="begin",
        type=float,
        default=0.0,
        metavar="S",
        help="begin so long after the first sample",
    )


def run(options: argparse.Namespace) -> Result:
    """Play to the end, and tell on the way what the devices say."""
    devices, clock = replayed(open_recording(options.session), options.speed)
    clock.seek(options.begin)
    while not clock.finished:
        line = _line(devices, clock)
        sys.stderr.write(f"\r{line}" if sys.stderr.isatty() else f"{line}\n")
    for device in devices.all().values():
        while len(device.read(0.0)):
            pass
    counts = {role: device.statistics() for role, device in devices.all().items()}
    text = [f"{told.received:9d} samples, {told.lost} missing  {role}" for role, told in counts.items()]
    duration_s = (clock.end_ns - clock.begin_ns) * 1e-9
    return Result(
        "\n".join([f"replayed {duration_s - options.begin:.3f} s of {options.session}", *text]),
        {
            "session": str(options.session),
            "seconds": duration_s - options.begin,
            "samples": {role: told.received for role, told in counts.items()},
            "missing": {role: told.lost for role, told in counts.items()},
        },
    )


def _line(devices: Devices, clock: ReplayClock) -> str:
    """Return one line about the samples of the next fifth of a second."""
    block = devices.force_sensor.read(_LINE_S / 4)
    poses = devices.robot.read(_LINE_S / 4)
    images = {name: len(camera.read(_LINE_S / 4)) for name, camera in devices.cameras.items()}
    force = f"{np.linalg.norm(block.wrench[:, :3].mean(axis=0)):7.2f} N" if len(block) else "   no force"
    place = ", ".join(f"{1e3 * value:.1f}" for value in poses.position[-1]) if len(poses) else "no pose"
    seen = ", ".join(f"{count} of {name}" for name, count in images.items())
    return f"{clock.position_s:8.2f} s  {force}  tool at ({place}) mm  images: {seen}"
