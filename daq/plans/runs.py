"""The sessions of a plan: which are due, where each goes, and the journal of those that are finished."""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from daq.errors import TrajectoryError
from daq.files.atomic import replace_text
from daq.plans.plan import Plan
from daq.plans.trial import Trial
from daq.progress import Progress
from daq.rig import Rig
from daq.session.session import Label, RecordSession
from daq.trajectories import Trajectory
from estimator.errors import InputError
from estimator.input_file import parse_json, read_input_text


@dataclass(frozen=True, slots=True)
class Run:
    """One session to be: trial and repetition, from 1, its order on the mounting, and its name in the journal."""

    trial: Trial
    number: int
    repeat: int
    order: int
    key: str


def runs(plan: Plan) -> list[Run]:
    """Return every session of a plan, in order."""
    found: list[Run] = []
    alike: Counter[str] = Counter()
    for number, trial in enumerate(plan.trials, start=1):
        for repeat in range(1, trial.repeat + 1):
            alike[trial.digest] += 1
            key = f"{trial.digest}.{alike[trial.digest]}"
            found.append(Run(trial, number, repeat, plan.first_order + len(found), key))
    return found


def journal_path(plan_file: Path) -> Path:
    """Return where the journal of a plan file lies."""
    return plan_file.with_suffix(".journal.json")


def finished(journal: Path) -> dict[str, str]:
    """Return the session folder of each finished run by its key; none where there is no journal yet."""
    if not journal.exists():
        return {}
    try:
        entries = parse_json(read_input_text(journal), journal)
    except InputError as error:
        raise TrajectoryError(str(error)) from error
    if not isinstance(entries, dict) or not all(isinstance(session, str) for session in entries.values()):
        raise TrajectoryError(
            f"{journal}: does not name a session folder for each finished trial; restore it from a copy, or remove it "
            "to record everything anew"
        )
    return entries


def due_runs(plan: Plan, journal: Path, folder: Path = Path()) -> list[tuple[Run, Trajectory]]:
    """Return the sessions that are not finished yet with their trajectories.

    Every one is laid out before the first is carried out, so that a mistake in the last line of a plan costs no
    morning.

    Parameters
    ----------
    journal : file that remembers what is finished
    folder : where tables and functions are looked for

    Raises
    ------
    TrajectoryError
        A trajectory cannot be laid out, or the journal cannot be read.
    """
    done = finished(journal)
    return [(run, run.trial.lay_out(folder)) for run in runs(plan) if run.key not in done]


def run_plan(
    plan: Plan, rig: Rig, record: RecordSession, progress: Progress, journal: Path, folder: Path = Path()
) -> Iterator[Path]:
    """Record what is not finished yet, and yield each session folder as soon as it is sealed.

    The journal is written after a session has ended well; one that was stopped or failed is
    recorded anew by the next run, into a folder of its own.

    Parameters
    ----------
    record : carries out one session: :meth:`daq.acquisition.client.Acquisition.record`
    journal : file that remembers what is finished
    folder : where tables and functions are looked for

    Raises
    ------
    TrajectoryError, SessionError, MotionLimitError, DeviceError, RecordingError
        As :func:`daq.session.session.run_session` does; what was finished before stays so.
    """
    done = finished(journal)
    for run, trajectory in due_runs(plan, journal, folder):
        session = new_folder(plan, rig, run, trajectory)
        label = Label(session.name, run.order, plan.operator, run.trial.notes)
        record(trajectory, session, label, progress)
        done[run.key] = str(session)
        replace_text(journal, json.dumps(done, indent=2) + "\n")
        yield session


def new_folder(plan: Plan, rig: Rig, run: Run, trajectory: Trajectory) -> Path:
    """Return the folder of a session to be: named by the plan's template, and not there yet."""
    now = datetime.now().astimezone()
    name = plan.name.format(
        date=f"{now:%Y-%m-%d}",
        time=f"{now:%H%M%S}",
        phantom=rig.specimen.phantom_id,
        trajectory=trajectory.kind,
        trial=run.number,
        repeat=run.repeat,
        order=run.order,
        operator=plan.operator,
    )
    candidates: Sequence[str] = [name, *(f"{name}_again{n}" for n in range(1, 1000))]
    return next(folder for one in candidates if not (folder := plan.sessions / one).exists())
