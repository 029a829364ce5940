"""Plans: several trials in order, each repeated, named by a template, and resumed after an interruption.

A plan file is TOML::

    format = "retraction-plan/1"
    sessions = "sessions"                    # folder of the session folders
    name = "{date}_{phantom}_{trial:02d}_{trajectory}_{repeat}"
    operator = "N. N."

    [[trials]]
    trajectory = "pull"                      # a name, a table "mine.csv", or a function "mine.py:spiral"
    repeat = 3
    holds_s = [3.0, 8.0]

What has been recorded is written into a journal beside the plan, so that the next run begins with the first trial that
is not finished. A trial whose parameters were edited counts as a new one; trials may be added anywhere.
"""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path, PurePosixPath, PureWindowsPath
from string import Formatter
from typing import TypeVar

from daq.errors import TrajectoryError
from daq.names import check_name
from daq.own_trajectories import load_function, read_table
from daq.progress import Progress
from daq.rig import Rig
from daq.routines import NAMED, repeated
from daq.session.session import Label, RecordSession
from daq.toml_tables import TomlFile
from daq.trajectories import STANDARD, STANDARD_SPEED, Dwell, Trajectory, lay_out
from estimator.errors import InputError
from estimator.input_file import parse_json, read_input_text
from robot_drivers.protocols import Speed

T = TypeVar("T")

FORMAT = "retraction-plan/1"
NAME_TEMPLATE = "{date}_{time}_{phantom}_{trajectory}_{repeat}"

_MOST_SESSIONS = 10_000
_MOST_ROUNDS = 1000
_FIELD = re.compile(r"[a-z]+:(0?[1-9]?d)?")

_SAMPLE_FIELDS = {
    "date": "2026-05-04",
    "time": "143210",
    "phantom": "P07",
    "trajectory": "pull",
    "trial": 1,
    "repeat": 1,
    "order": 1,
    "operator": "",
}


@dataclass(frozen=True, slots=True)
class Trial:
    """One line of a plan; what is None is as the trajectory has it.

    Attributes
    ----------
    trajectory : a name of :data:`daq.routines.NAMED`, a CSV table, or ``file.py:function``
    repeat : how many sessions
    rounds : how often the steps are gone through within one session
    steps, step_length_m, angle_rad, return_steps, speed_m_s : of a standard retraction; a function takes steps,
        return_steps and speed, a table the speed
    settle_s, measure_s, holds_s : of the standing still
    notes : free text
    """

    trajectory: str
    repeat: int = 1
    rounds: int = 1
    steps: int | None = None
    step_length_m: float | None = None
    angle_rad: float | None = None
    return_steps: int | None = None
    speed_m_s: float | None = None
    settle_s: float | None = None
    measure_s: float | None = None
    holds_s: tuple[float, ...] = ()
    notes: str = ""

    def __post_init__(self) -> None:
        if not (1 <= self.repeat <= _MOST_SESSIONS and 1 <= self.rounds <= _MOST_ROUNDS):
            raise ValueError(
                f"repeat and rounds must be at least 1, at most {_MOST_SESSIONS} and {_MOST_ROUNDS}"
            )

    @property
    def digest(self) -> str:
        """A short name of what is done, whatever is noted about it and however often."""
        text = json.dumps(asdict(replace(self, repeat=1, notes="")), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def lay_out(self, folder: Path) -> Trajectory:
        """Return the trajectory; tables and functions are looked for in ``folder``.

        Raises
        ------
        TrajectoryError
            It is unknown, or takes no such parameters.
        """
        trajectory = self._one_round(folder)
        return trajectory if self.rounds == 1 else repeated(trajectory, self.rounds)

    def _one_round(self, folder: Path) -> Trajectory:
        if self.trajectory in STANDARD:
            return self._retraction()
        speed = replace(STANDARD_SPEED, linear=_either(self.speed_m_s, STANDARD_SPEED.linear))
        if self.trajectory.endswith(".csv"):
            self._takes("speed_m_s", "settle_s", "measure_s")
            return read_table(folder / self.trajectory, speed, self._dwell(Dwell()))
        file, _, function = self.trajectory.rpartition(":")
        if file.endswith(".py"):
            self._takes("speed_m_s", "settle_s", "measure_s", "holds_s", "steps", "return_steps")
            path = load_function(folder / file, function)
            steps, back = _either(self.steps, 10), _either(self.return_steps, 5)
            return lay_out(function, path, steps, back, speed, self._dwell(Dwell()))
        self._takes()
        if self.trajectory not in NAMED:
            raise TrajectoryError(
                f"trajectory {self.trajectory!r} is unknown; name one of {', '.join(NAMED)}, a table such as "
                "mine.csv, or a function such as mine.py:spiral"
            )
        return NAMED[self.trajectory]()

    def _retraction(self) -> Trajectory:
        standard = STANDARD[self.trajectory]
        return replace(
            standard,
            steps=_either(self.steps, standard.steps),
            step_length=_either(self.step_length_m, standard.step_length),
            angle=_either(self.angle_rad, standard.angle),
            return_steps=_either(self.return_steps, standard.return_steps),
            speed=Speed(_either(self.speed_m_s, standard.speed.linear), standard.speed.angular),
            dwell=self._dwell(standard.dwell),
        ).trajectory()

    def _dwell(self, usual: Dwell) -> Dwell:
        return Dwell(
            usual.rest_s,
            _either(self.settle_s, usual.settle_s),
            _either(self.measure_s, usual.measure_s),
            self.holds_s,
        )

    def _takes(self, *allowed: str) -> None:
        """Refuse a parameter that the trajectory would not heed."""
        usual = Trial(self.trajectory)
        always = ("trajectory", "repeat", "rounds", "notes")
        for name, value in asdict(self).items():
            if name not in (*always, *allowed) and value != getattr(usual, name):
                raise TrajectoryError(
                    f"trajectory {self.trajectory!r} takes no {name}; it takes {', '.join(allowed) or 'none'}"
                )


@dataclass(frozen=True, slots=True)
class Plan:
    """What to record, in this order.

    Attributes
    ----------
    trials : each of them ``repeat`` times
    sessions : folder in which the session folders are made
    name : template of their names, with the fields date, time, phantom, trajectory, trial, repeat, order, operator
    operator : who records
    first_order : which experiment on the mounting the first one is
    """

    trials: tuple[Trial, ...]
    format: str = FORMAT
    sessions: Path = Path("sessions")
    name: str = NAME_TEMPLATE
    operator: str = ""
    first_order: int = 1

    def __post_init__(self) -> None:
        try:
            for _, field, width, conversion in Formatter().parse(self.name):
                if field is not None and (conversion or not _FIELD.fullmatch(f"{field}:{width}")):
                    raise ValueError("a field is a name, and for a number its width, as {trial:02d}")
            sample = self.name.format(**{**_SAMPLE_FIELDS, "operator": self.operator or "N"})
        except (KeyError, IndexError, ValueError) as error:
            raise ValueError(
                f"name template {self.name[:80]!r} cannot be filled in ({error}); use {', '.join(_SAMPLE_FIELDS)}"
            ) from error
        if self.format != FORMAT or not self.trials:
            raise ValueError(f'a plan has format = "{FORMAT}" and at least one of [[trials]]')
        check_name(sample, "name, filled in,")
        if sum(trial.repeat for trial in self.trials) > _MOST_SESSIONS:
            raise ValueError(f"repeat adds up to more than {_MOST_SESSIONS} sessions")


@dataclass(frozen=True, slots=True)
class Run:
    """One session to be: trial and repetition, from 1, its order on the mounting, and its name in the journal."""

    trial: Trial
    number: int
    repeat: int
    order: int
    key: str


def read_plan(path: Path) -> Plan:
    """Read a plan file; raises RigError that names file, line and key of what is wrong."""
    file = TomlFile.read(path)
    plan = file.build(Plan, file.root)
    for number, trial in enumerate(plan.trials):
        if _leads_elsewhere(trial.trajectory):
            raise file.mistake(
                ("trials", number, "trajectory"),
                "names a program outside of the plan's folder, which is not run; copy it there",
            )
    return plan


def _leads_elsewhere(trajectory: str) -> bool:
    """Tell whether a trajectory is a function of a file that is not beside the plan or below."""
    program = trajectory.rpartition(":")[0]
    paths = (PurePosixPath(program), PureWindowsPath(program))
    return program.endswith(".py") and any(
        path.is_absolute() or path.drive or ".." in path.parts for path in paths
    )


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
        _write_journal(journal, done)
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


def _write_journal(journal: Path, done: dict[str, str]) -> None:
    """Write in one step: a reader sees the old journal or the new one."""
    draft = journal.with_name(journal.name + ".new")
    draft.write_text(json.dumps(done, indent=2) + "\n", encoding="utf-8")
    draft.replace(journal)


def _either(given: T | None, usual: T) -> T:
    return usual if given is None else given
