"""The arguments that both entries share."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from challenge_baselines.readings_file import Opened, Timed, read_opened, read_readings


@dataclass(frozen=True)
class Task:
    """A sealed set to answer, what to learn from, and where to write."""

    cases: Path
    readings: dict[str, Timed]
    opened: list[Opened]
    out: Path


def task_of(arguments: list[str], description: str) -> Task:
    """Return what the arguments ask for."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("cases", type=Path, metavar="CASES", help="folder of the sealed cases")
    parser.add_argument("readings", type=Path, metavar="READINGS", help="their readings")
    parser.add_argument(
        "--opened",
        type=Path,
        nargs=2,
        action="append",
        required=True,
        metavar=("READINGS", "KEYS"),
        help="readings of an opened set and the folder of its keys; may be given more than once",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="answers, JSON")
    options = parser.parse_args(arguments)
    opened = [one for readings, keys in options.opened for one in read_opened(readings, keys)]
    return Task(options.cases, read_readings(options.readings), opened, options.out)
