"""The register of answers: whose hash stands there from before the first opening was given blind."""

import hashlib
from datetime import datetime
from pathlib import Path
from typing import Literal

from estimator.blind.sealing.openings import Openings, instant_of, now
from estimator.input_file import MOST_TEXT_BYTES, read_input, read_input_text

REGISTER_FILE = "entries.txt"

# Whether the answers can have been given with the keys at hand.
Standing = Literal["registered before the keys were opened", "dated before, unregistered", "after an opening"]


def hash_of_answers(file: Path) -> str:
    """Return the SHA-256 of a file of answers, as ``sha256sum`` tells it.

    Raises
    ------
    InputError
        It cannot be read.
    """
    return hashlib.sha256(read_input(file, MOST_TEXT_BYTES)).hexdigest()


def register(folder: Path, answers_hash: str, name: str) -> datetime:
    """Add a line ``DATE HASH NAME`` to the register in a folder, unless the hash stands there, and return its date.

    Raises
    ------
    InputError
        The register cannot be read.
    """
    there = registered(folder)
    if answers_hash not in there:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / REGISTER_FILE).open("a", encoding="utf-8") as log:
            log.write(f"{now()} {answers_hash} {' '.join(name.split())}\n")
        there = registered(folder)
    return there[answers_hash]


def registered(folder: Path) -> dict[str, datetime]:
    """Return when each hash in the register of a folder was first registered; empty where there is no register.

    Raises
    ------
    InputError
        The register cannot be read.
    """
    file = folder / REGISTER_FILE
    found: dict[str, datetime] = {}
    for line in read_input_text(file).splitlines() if file.exists() else ():
        date, _, rest = line.partition(" ")
        instant = instant_of(date)
        if instant is not None:
            found.setdefault(rest.partition(" ")[0], instant)
    return found


def standing(answered: datetime, registered_at: datetime | None, openings: Openings) -> Standing:
    """Tell whether answers were given before the keys were first opened.

    Parameters
    ----------
    answered : the date that the answers bear, which whoever gave them has written
    registered_at : when their hash was registered; None where it was not
    openings : of the keys, the present one among them
    """
    if openings.first is None or (registered_at is not None and registered_at <= openings.first):
        return "registered before the keys were opened" if registered_at else "dated before, unregistered"
    return "dated before, unregistered" if answered <= openings.first else "after an opening"
