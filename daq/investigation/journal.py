"""What an investigation has done so far, in a file: an interrupted one goes on with the next manoeuvre."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from daq.errors import SessionError
from daq.files.atomic import replace_text
from daq.investigation.manoeuvre import Manoeuvre
from estimator.errors import InputError
from estimator.input_file import parse_json, read_input_text

FORMAT = "retraction-investigation/1"


@dataclass(frozen=True, slots=True)
class Entry:
    """One manoeuvre that was carried out.

    Attributes
    ----------
    manoeuvre : what was done
    experiment : folder of what was measured
    seconds : of rig and person
    expected : information that it was expected to give, nats; 0 for the first, of which nothing is expected
    reason : why it was chosen
    probabilities : of the answers after it, the most probable first
    in_full : whether these are of a diagnosis in full
    """

    manoeuvre: Manoeuvre
    experiment: str
    seconds: float
    expected: float
    reason: str
    probabilities: Mapping[str, float] = field(default_factory=dict)
    in_full: bool = False


@dataclass(frozen=True, slots=True)
class Journal:
    """An investigation so far.

    Attributes
    ----------
    phantom_id : of the specimen
    entries : in the order in which they were done
    refused : manoeuvres that the operator does not want, and such as had the robot held
    """

    phantom_id: str
    entries: tuple[Entry, ...] = ()
    refused: tuple[Manoeuvre, ...] = ()

    @property
    def seconds(self) -> float:
        """Of rig and person so far."""
        return sum(one.seconds for one in self.entries)

    @property
    def released(self) -> bool:
        """Whether the tissue was taken out of the jaws: what strains it would be another mounting."""
        return any(one.manoeuvre.asks for one in self.entries)

    def with_entry(self, entry: Entry) -> "Journal":
        """Return the journal after one manoeuvre more."""
        return replace(self, entries=(*self.entries, entry))

    def with_last(self, probabilities: Mapping[str, float], in_full: bool) -> "Journal":
        """Return the journal with what the experiments so far were found to say."""
        last = replace(self.entries[-1], probabilities=dict(probabilities), in_full=in_full)
        return replace(self, entries=(*self.entries[:-1], last))

    def refusing(self, manoeuvre: Manoeuvre) -> "Journal":
        """Return the journal with a manoeuvre that is not to be proposed again."""
        return replace(self, refused=(*self.refused, manoeuvre))


def write_journal(journal: Journal, path: Path) -> None:
    """Write a journal, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    told = {"format": FORMAT, **asdict(journal)}
    replace_text(path, json.dumps(told, indent=1) + "\n")


def read_journal(path: Path, phantom_id: str) -> Journal:
    """Read a journal, a new one where there is none.

    Raises
    ------
    SessionError
        It is none, or of another specimen.
    """
    if not path.exists():
        return Journal(phantom_id)
    try:
        told = parse_json(read_input_text(path), path)
        if not isinstance(told, dict) or told.get("format") != FORMAT:
            raise ValueError(f'its format is not "{FORMAT}"')
        journal = Journal(
            str(told["phantom_id"]),
            tuple(_entry(one) for one in told["entries"]),
            tuple(map(_manoeuvre, told["refused"])),
        )
    except (InputError, KeyError, TypeError, ValueError) as error:
        raise SessionError(
            f"{path}: is no journal of an investigation ({error}); name another folder, or restore it from a copy"
        ) from error
    if journal.phantom_id != phantom_id:
        raise SessionError(
            f"{path}: is of specimen {journal.phantom_id!r}, the rig file has {phantom_id!r}; name another folder"
        )
    return journal


def _entry(told: object) -> Entry:
    if not isinstance(told, dict):
        raise ValueError("an entry is no object")
    return Entry(
        _manoeuvre(told["manoeuvre"]),
        str(told["experiment"]),
        float(told["seconds"]),
        float(told["expected"]),
        str(told["reason"]),
        {str(label): float(value) for label, value in told["probabilities"].items()},
        bool(told["in_full"]),
    )


def _manoeuvre(told: object) -> Manoeuvre:
    if not isinstance(told, dict):
        raise ValueError("a manoeuvre is no object")
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in told.items()
    }
    return Manoeuvre(**values)
