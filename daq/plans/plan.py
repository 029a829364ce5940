"""What to record in which order, and the file that says so."""

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from string import Formatter

from daq.files.names import check_name
from daq.files.toml_tables import TomlFile
from daq.plans.trial import MOST_SESSIONS, Trial

FORMAT = "retraction-plan/1"
NAME_TEMPLATE = "{date}_{time}_{phantom}_{trajectory}_{repeat}"

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
        if sum(trial.repeat for trial in self.trials) > MOST_SESSIONS:
            raise ValueError(f"repeat adds up to more than {MOST_SESSIONS} sessions")


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
