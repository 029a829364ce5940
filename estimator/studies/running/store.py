"""Keeps what became of each case in a file of its own as soon as it is known, so that a study goes on after a stop."""

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from estimator.errors import InputError
from estimator.input_file import parse_json, read_input_text
from estimator.studies.running.case import Case, Outcome, digest


@dataclass(frozen=True, slots=True)
class OutcomeStore:
    """A folder of outcomes; it may be deleted at any time, and single files of it too."""

    folder: Path

    def read(self, case: Case) -> Outcome | None:
        """Return what became of a case; None where that is not known yet.

        Raises
        ------
        InputError
            The file is damaged.
        """
        file = self._file(case)
        if not file.exists():
            return None
        try:
            kept = parse_json(read_input_text(file), file)
            return _outcome(kept["row"], kept["failure"])
        except (InputError, KeyError, TypeError):
            raise InputError(
                f"{file}: the kept result is damaged; remove the file, and it is made anew"
            ) from None

    def write(self, case: Case, outcome: Outcome) -> None:
        """Keep what became of a case; a reader sees the whole file or none."""
        self.folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"case": case.name, "identity": case.identity, **asdict(outcome)}, indent=1)
        draft = self._file(case).with_suffix(f".{os.getpid()}.new")
        draft.write_text(text + "\n", encoding="utf-8")
        draft.replace(self._file(case))

    def _file(self, case: Case) -> Path:
        return self.folder / f"{digest(case)}.json"


def _outcome(row: object, failure: object) -> Outcome:
    """Return the outcome; raises TypeError where these cannot be one."""
    values = row if isinstance(row, dict) else {}
    if (row is None) == (not failure) or not isinstance(failure, str):
        raise TypeError("neither a row nor a failure, or both")
    if row is not None and not all(isinstance(value, int | float | str) for value in values.values()):
        raise TypeError("a value of the row is neither a number nor a text")
    return Outcome(None if row is None else values, failure)
