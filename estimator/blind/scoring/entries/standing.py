"""Whether an entry answers the set whose keys are at hand, and whether it did so before they were opened."""

from pathlib import Path

from estimator.blind.scoring.entries.entry import Entry, case_names
from estimator.blind.sealing.commitment import read_commitment
from estimator.blind.sealing.openings import Openings
from estimator.blind.sealing.register import Standing, registered, standing
from estimator.errors import InputError


def check_set(entry: Entry, keys: Path) -> None:
    """Check that an entry answers every case of the set that keys belong to, without opening them.

    Raises
    ------
    InputError
        The keys were never committed to, are of another set, or a case has no answer.
    """
    published = read_commitment(keys)
    if entry.set_hash != published.set_hash:
        raise InputError(
            f"{entry.name}: answers the set {entry.set_hash[:12]}…, and the keys in {keys} are of "
            f"{published.set_hash[:12]}…; score it with the keys of its own set"
        )
    names = case_names(published)
    if unlike := sorted(set(names) ^ entry.answers.keys()):
        raise InputError(
            f"{entry.name}: {unlike[0]} is not both a case and answered; have retract benchmark enter tell all faults"
        )


def standing_of(entry: Entry, keys: Path, openings: Openings) -> Standing:
    """Tell whether an entry was given before the keys were first opened."""
    return standing(entry.answered, registered(keys).get(entry.answers_hash), openings)
