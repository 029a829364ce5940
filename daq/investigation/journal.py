"""What an investigation has done so far, in a file: an interrupted one goes on with the next manoeuvre."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from daq.errors import SessionError
from daq.files.atomic import replace_text
from daq.investigation.manoeuvre import RELEASED, Manoeuvre
from estimator.errors import InputError
from estimator.input_file import parse_json, read_input_text
from estimator.json_dataclass import from_json

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
class Dropped:
    """A manoeuvre that a limit forbade when it was to begin: nothing has moved.

    Attributes
    ----------
    manoeuvre : what was to be done
    why : what forbade it
    """

    manoeuvre: Manoeuvre
    why: str

    @property
    def words(self) -> str:
        """Say what was dropped, and why."""
        return f"{self.manoeuvre.words}: {self.why}"


@dataclass(frozen=True, slots=True)
class Journal:
    """An investigation so far.

    Attributes
    ----------
    phantom_id : of the specimen
    entries : in the order in which they were done
    refused : manoeuvres that the operator does not want, and such as had the robot held
    dropped : manoeuvres that the rig refused before anything moved
    """

    phantom_id: str
    entries: tuple[Entry, ...] = ()
    refused: tuple[Manoeuvre, ...] = ()
    dropped: tuple[Dropped, ...] = ()

    @property
    def seconds(self) -> float:
        """Of rig and person so far."""
        return sum(one.seconds for one in self.entries)

    @property
    def released(self) -> bool:
        """Whether the tissue was taken out of the jaws: what strains it would be another mounting."""
        return any(one.asks for one in self._tried)

    def is_open(self, manoeuvre: Manoeuvre) -> bool:
        """Whether a manoeuvre was neither done, nor refused, nor dropped, and the tissue is still as it needs it."""
        seen = manoeuvre in self._tried or manoeuvre in self.refused
        return not seen and (manoeuvre.kind in RELEASED or not self.released)

    @property
    def _tried(self) -> list[Manoeuvre]:
        return [*(one.manoeuvre for one in self.entries), *(one.manoeuvre for one in self.dropped)]

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

    def dropping(self, dropped: Dropped) -> "Journal":
        """Return the journal with a manoeuvre that the rig refuses."""
        return replace(self, dropped=(*self.dropped, dropped))


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
        if not isinstance(told, dict) or told.pop("format", None) != FORMAT:
            raise ValueError(f'its format is not "{FORMAT}"')
        if told.keys() != {"phantom_id", "entries", "refused", "dropped"}:
            raise ValueError("has not the entries phantom_id, entries, refused, dropped")
        journal = Journal(
            str(told["phantom_id"]),
            tuple(map(_entry, _objects(told["entries"]))),
            tuple(from_json(Manoeuvre, one) for one in _objects(told["refused"])),
            tuple(map(_dropped, _objects(told["dropped"]))),
        )
    except (InputError, ValueError) as error:
        raise SessionError(
            f"{path}: is no journal of an investigation ({error}); name another folder, or restore it from a copy"
        ) from error
    if journal.phantom_id != phantom_id:
        raise SessionError(
            f"{path}: is of specimen {journal.phantom_id!r}, the rig file has {phantom_id!r}; name another folder"
        )
    return journal


def _objects(told: object) -> list[dict[str, Any]]:
    if not isinstance(told, list) or not all(isinstance(one, dict) for one in told):
        raise ValueError("entries, refused and dropped are no lists of objects")
    return told


def _dropped(told: dict[str, Any]) -> Dropped:
    if told.keys() != {"manoeuvre", "why"}:
        raise ValueError("what is dropped has not the entries manoeuvre, why")
    return Dropped(from_json(Manoeuvre, told["manoeuvre"]), str(told["why"]))


@dataclass(frozen=True, slots=True)
class _KeptEntry:
    """An entry as JSON has it, but for its manoeuvre."""

    experiment: str
    seconds: float
    expected: float
    reason: str
    probabilities: Mapping[str, float]
    in_full: bool


def _entry(told: dict[str, Any]) -> Entry:
    manoeuvre = from_json(Manoeuvre, told.get("manoeuvre"))
    kept = from_json(_KeptEntry, {key: value for key, value in told.items() if key != "manoeuvre"})
    return Entry(manoeuvre, **{field.name: getattr(kept, field.name) for field in fields(kept)})
