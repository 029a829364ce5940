"""``retract record``: carry out retractions, or a plan of several, and record each."""

import argparse
import math
from datetime import datetime
from pathlib import Path

from daq.acquisition.client import Acquisition
from daq.cli.rigs import VIRTUAL, opened_rig
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.errors import TrajectoryError
from daq.plans import Trial, due_runs, journal_path, read_plan, run_plan, runs
from daq.recording.folder import SessionInfo, read_info
from daq.rig import Rig
from daq.session.session import Label
from daq.session_report import read_report
from daq.trajectories import Trajectory
from daq.trajectories.routines import NAMED

_EXAMPLES = """  retract record lab.toml --trajectory pull --order 1
  retract record --rig lab.toml --trajectory pull --repeat 3
  retract record lab.toml --trajectory twist_and_pull --order 2 --hold 3 --hold 8 --hold 18
  retract record lab.toml --trajectory mine.csv
  retract record lab.toml --trajectory mine.py:spiral --steps 20
  retract record lab.toml --plan plan.toml   begins, after an interruption, with the first trial not finished
  retract record virtual --output runs/first"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "record", "carry out one retraction and record it", _EXAMPLES, run)
    rig = parser.add_mutually_exclusive_group(required=True)
    rig.add_argument(
        "rig", metavar="RIG", nargs="?", help=f'rig file, or "{VIRTUAL}" for an emulated laboratory'
    )
    rig.add_argument("--rig", dest="rig", metavar="RIG", help="the same")
    parser.add_argument(
        "--plan", type=Path, metavar="FILE", help="record the trials of a plan file, in order"
    )
    parser.add_argument(
        "--trajectory",
        type=trajectory_name,
        default="pull",
        help=f"{', '.join(NAMED)}; or a table FILE.csv, or a function FILE.py:NAME (default: %(default)s)",
    )
    parser.add_argument("--repeat", type=int, default=1, metavar="N", help="record it so many times")
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
    if options.plan is not None:
        return _run_plan(options)
    trial = chosen_trial(options)
    trajectory = trial.lay_out(Path())
    recorded: dict[Path, SessionInfo] = {}
    with opened_rig(options.rig) as rig, Acquisition(rig) as acquisition, progress() as tell:
        if options.release:
            acquisition.release()
        for repeat in range(trial.repeat):
            folder = _folder(options.output, rig, trajectory, repeat)
            name = options.name or trajectory.kind
            label = Label(name, options.order + repeat, options.operator, options.notes)
            try:
                recorded[folder] = acquisition.record(trajectory, folder, label, tell)
            except KeyboardInterrupt as interrupt:
                raise type(interrupt)(
                    f"interrupted: the robot is held, the recording is sealed in {folder}; "
                    "the next session needs --release"
                ) from None
    return _result(recorded)


def chosen_trial(options: argparse.Namespace) -> Trial:
    """Return what the options ask for; they are in mm and degrees."""
    try:
        return Trial(
            options.trajectory,
            repeat=options.repeat,
            steps=options.steps,
            step_length_m=None if options.step_length is None else options.step_length * 1e-3,
            angle_rad=None if options.angle is None else math.radians(options.angle),
            return_steps=options.return_steps,
            speed_m_s=None if options.speed is None else options.speed * 1e-3,
            settle_s=options.settle,
            measure_s=options.measure,
            holds_s=tuple(options.hold),
        )
    except ValueError as error:
        raise TrajectoryError(str(error)) from error


def _run_plan(options: argparse.Namespace) -> Result:
    plan, journal = read_plan(options.plan), journal_path(options.plan)
    due_runs(plan, journal, options.plan.parent)  # refuses a mistake before any device is connected
    recorded: dict[Path, SessionInfo] = {}
    with opened_rig(options.rig) as rig, Acquisition(rig) as acquisition, progress() as tell:
        if options.release:
            acquisition.release()
        for session in run_plan(plan, rig, acquisition.record, tell, journal, options.plan.parent):
            recorded[session] = read_info(session)
    before = len(runs(plan)) - len(recorded)
    return _result(recorded, f"{before} of {len(runs(plan))} were finished before")


def trajectory_name(text: str) -> str:
    """Return the name of a trajectory as it stands on the command line; raises what argparse tells in one line."""
    if text in NAMED or text.endswith(".csv") or text.rpartition(":")[0].endswith(".py"):
        return text
    raise argparse.ArgumentTypeError(
        f"invalid choice: {text!r} (choose from {', '.join(NAMED)}, FILE.csv, FILE.py:NAME)"
    )


def _folder(output: Path | None, rig: Rig, trajectory: Trajectory, repeat: int) -> Path:
    if output is None:
        date = datetime.now().astimezone().strftime("%Y-%m-%d_%H%M%S")
        return Path("sessions") / f"{date}_{rig.specimen.phantom_id}_{trajectory.kind}"
    return output if repeat == 0 else output.with_name(f"{output.name}_{repeat + 1}")


def _result(recorded: dict[Path, SessionInfo], note: str = "") -> Result:
    lines = [_describe(folder, info) for folder, info in recorded.items()]
    sessions = [
        {"session": str(folder), "samples": info.samples, "problems": list(info.problems)}
        for folder, info in recorded.items()
    ]
    first = sessions[0] if len(sessions) == 1 else {}
    return Result("\n".join([*lines, note] if note else lines), {**first, "sessions": sessions})


def _describe(folder: Path, info: SessionInfo) -> str:
    samples = f"{info.samples['/force/wrench']} force samples"
    ends = ("/image", "/image_raw")
    images = sum(
        count for topic, count in info.samples.items() if topic.endswith(ends) and "/depth/" not in topic
    )
    lines = [f"recorded {samples} and {images} images in {folder}"]
    lines += [f"  {line}" for line in read_report(folder).lines()]
    return "\n".join(lines + [f"  problem: {problem}" for problem in info.problems])
