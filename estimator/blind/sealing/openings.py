"""The log of how often the keys of a set were opened, when, and what for."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from estimator.input_file import read_input_text

OPENINGS_FILE = "openings.txt"


@dataclass(frozen=True, slots=True)
class Openings:
    """How often keys have been opened, and when first; None where no line tells a date."""

    count: int
    first: datetime | None


def count_opening(keys: Path, reader: str) -> Openings:
    """Add a line to the log beside the keys and return what it says; a log that is none is left alone.

    Parameters
    ----------
    reader : what the keys are opened for, one line

    Raises
    ------
    InputError
        The log cannot be read.
    """
    file = keys / OPENINGS_FILE
    before = read_input_text(file) if file.is_symlink() or file.exists() else ""
    line = f"{now()} {' '.join(reader.split())}\n"
    with file.open("a", encoding="utf-8") as log:
        log.write(line if before.endswith("\n") or not before else f"\n{line}")
    return _read(before + "\n" + line if before and not before.endswith("\n") else before + line)


def read_openings(keys: Path) -> Openings:
    """Return what the log beside the keys says, without opening them.

    Raises
    ------
    InputError
        The log cannot be read.
    """
    file = keys / OPENINGS_FILE
    return _read(read_input_text(file) if file.exists() else "")


def now() -> str:
    """Return the present instant as ISO 8601 in UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def instant_of(text: str) -> datetime | None:
    """Return an instant written as ISO 8601 with its offset from UTC; None where it is none."""
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        return None
    return found if found.tzinfo is not None else None


def _read(text: str) -> Openings:
    lines = text.splitlines()
    dates = [date for line in lines if (date := instant_of(line.partition(" ")[0])) is not None]
    return Openings(len(lines), min(dates, default=None))
