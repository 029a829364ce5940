"""``retract record``: carry out one retraction and record it."""

import argparse
import math
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TypeVar

from daq.cli.rigs import add_rig, opened_rig
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.recording.folder import SessionInfo
from daq.rig import Rig, make_devices
from daq.session.session import Label, connected, run_session
from daq.trajectories import STANDARD, Dwell, Retraction
from robot_drivers.protocols import Speed

T = TypeVar("T")

_EXAMPLES = """  retract record lab.toml --trajectory pull --order 1
  retract record lab.toml --trajectory twist_and_pull --order 2 --hold 3 --hold 8 --hold 18
  retract record virtual --output runs/first"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "record", "carry out one retraction and record it", _EXAMPLES, run)
    add_rig(parser)
    parser.add_argument("--trajectory", choices=sorted(STANDARD), default="pull", help="default: %(default)s")
    parser.add_argument("--steps", type=int, help="number of steps out")
    parser.add_argument("--step-length", type=float, metavar="MM", help="way of each step along +x")
    parser.add_argument("--angle", type=float, metavar="DEG", help="turn in all")
    parser.add_argument("--return-steps", type=int, help="number of steps back")
    parser.add_argument("--speed", type=float, metavar="MM/S", help="between the steps")
    parser.add_argument("--settle", type=float, metavar="S", help="standing still before measuring")
    parser.add_argument("--measure", type=float, metavar="S", help="length of each measuring window")
    parser.add_argument(
        "--hold",
        type=float,
        metavar="S",
        action="append",
        default=[],
        help="measure once more at the last step, so long after",
    )
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help="session folder (default: sessions/DATE_ID_KIND)"
    )
    parser.add_argument("--name", help="of the experiment (default: the trajectory)")
    parser.add_argument(
        "--order", type=int, default=1, help="1 for the first on this mounting, 2 for the next, ..."
    )
    parser.add_argument("--operator", default="", help="who records")
    parser.add_argument("--notes", default="", help="free text")
    parser.add_argument(
        "--release",
        action="store_true",
        help="allow a robot that was held to move again; look at the cell first",
    )


def run(options: argparse.Namespace) -> Result:
    """Record, and tell where the session lies."""
    retraction = chosen_retraction(options)
    with opened_rig(options.rig) as rig, connected(make_devices(rig)) as devices, progress() as tell:
        folder = options.output or _default_folder(rig, retraction)
        if options.release:
            devices.robot.resume()
        label = Label(options.name or retraction.kind, options.order, options.operator, options.notes)
        try:
            info = run_session(rig, devices, retraction.trajectory(), folder, label, tell)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                f"interrupted: the robot is held, the recording is sealed in {folder}; "
                "the next session needs --release"
            ) from None
    return Result(
        _describe(folder, info),
        {"session": str(folder), "samples": info.samples, "problems": list(info.problems)},
    )


def chosen_retraction(options: argparse.Namespace) -> Retraction:
    """Return the standard retraction with what the options change."""
    standard = STANDARD[options.trajectory]
    dwell = Dwell(
        rest_s=standard.dwell.rest_s,
        settle_s=_either(options.settle, standard.dwell.settle_s),
        measure_s=_either(options.measure, standard.dwell.measure_s),
        holds_s=tuple(options.hold),
    )
    linear = _either(options.speed, standard.speed.linear * 1e3) * 1e-3
    return replace(
        standard,
        steps=_either(options.steps, standard.steps),
        step_length=_either(options.step_length, standard.step_length * 1e3) * 1e-3,
        angle=math.radians(_either(options.angle, math.degrees(standard.angle))),
        return_steps=_either(options.return_steps, standard.return_steps),
        speed=Speed(linear, standard.speed.angular),
        dwell=dwell,
    )


def _either(given: T | None, standard: T) -> T:
    return standard if given is None else given


def _default_folder(rig: Rig, retraction: Retraction) -> Path:
    date = datetime.now().astimezone().strftime("%Y-%m-%d_%H%M%S")
    return Path("sessions") / f"{date}_{rig.specimen.phantom_id}_{retraction.kind}"


def _describe(folder: Path, info: SessionInfo) -> str:
    samples = f"{info.samples['/force/wrench']} force samples"
    images = sum(count for topic, count in info.samples.items() if topic.endswith("/image"))
    lines = [f"recorded {samples} and {images} images in {folder}"]
    return "\n".join(lines + [f"  problem: {problem}" for problem in info.problems])
