"""What a check says: one line of what, where, and what to do, with a grade."""

from dataclasses import dataclass
from typing import Literal

from estimator.experiment.model import EXPERIMENT_FILE, OBSERVATIONS_FILE
from estimator.experiment.observations import line_of_row

Grade = Literal["wrong", "suspicious", "fine"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One judgement.

    Attributes
    ----------
    grade : ``"wrong"`` is what cannot be as it stands; ``"suspicious"`` what may be, and seldom is
    check : name of the check
    what : what was found, with figures and units
    do : what to do about it; empty where nothing is to be done
    file : in the experiment folder; empty where it is the folder itself
    line : of the file, from 1; None where the finding is of no line in particular
    column : of the table, or key of the experiment's file; empty where there is none
    """

    grade: Grade
    check: str
    what: str
    do: str = ""
    file: str = ""
    line: int | None = None
    column: str = ""

    @property
    def where(self) -> str:
        """File, line and column, as far as there are any."""
        line = f", line {self.line}" if self.line is not None else ""
        # keys of the experiment's file begin with a bracket, columns do not
        column = f"{' ' if self.column.startswith('[') else ', column '}{self.column}" if self.column else ""
        return f"{self.file}{line}{column}"


def of_rows(
    grade: Grade, check: str, what: str, do: str, *, row: int | None = None, column: str = ""
) -> Finding:
    """Return a finding about the table of observations; ``row`` counts from 0."""
    line = None if row is None else line_of_row(row)
    return Finding(grade, check, what, do, OBSERVATIONS_FILE, line, column)


def of_facts(grade: Grade, check: str, what: str, do: str, key: str) -> Finding:
    """Return a finding about what the experiment's file states; ``key`` as in ``"[phantom] size"``."""
    return Finding(grade, check, what, do, EXPERIMENT_FILE, None, key)
