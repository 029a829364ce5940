"""The operator's queue: trials in order, each with what became of it; kept in a file, so that a day can be resumed.

Every function returns a new queue; the file is ``queue.json`` in the folder of the sessions.
"""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

from daq.errors import RecordingError
from daq.files.atomic import replace_text
from daq.plans import Trial
from estimator.errors import InputError
from estimator.input_file import parse_json, read_input_text

QUEUE_FILE = "queue.json"

EntryState = Literal["waiting", "running", "done", "failed", "stopped"]


@dataclass(frozen=True, slots=True)
class Entry:
    """One session to be, or what became of it.

    Attributes
    ----------
    trial : what is done; its ``repeat`` is 1, for each repetition is an entry of its own
    session : its folder once it has begun
    remark : why it failed or was stopped
    """

    trial: Trial
    state: EntryState = "waiting"
    session: Path | None = None
    remark: str = ""


Queue = tuple[Entry, ...]


def with_trial(queue: Queue, trial: Trial) -> Queue:
    """Return the queue with a trial at its end, as often as it is to be repeated."""
    return (*queue, *(Entry(replace(trial, repeat=1)) for _ in range(trial.repeat)))


def without(queue: Queue, places: Iterable[int]) -> Queue:
    """Return the queue without some entries; one that runs stays."""
    gone = set(places)
    return tuple(e for n, e in enumerate(queue) if n not in gone or e.state == "running")


def moved(queue: Queue, place: int, by: int) -> Queue:
    """Return the queue with an entry moved up (negative) or down, as far as that goes."""
    target = max(0, min(len(queue) - 1, place + by))
    rest = [*queue[:place], *queue[place + 1 :]]
    return (*rest[:target], queue[place], *rest[target:])


def repeated(queue: Queue, place: int) -> Queue:
    """Return the queue with an entry once more, behind itself."""
    return (*queue[: place + 1], Entry(queue[place].trial), *queue[place + 1 :])


def changed(queue: Queue, place: int, entry: Entry) -> Queue:
    """Return the queue with another entry in a place."""
    return (*queue[:place], entry, *queue[place + 1 :])


def next_place(queue: Queue) -> int | None:
    """Return which entry is to be carried out next: the first one that waits; None if none does."""
    return next((n for n, entry in enumerate(queue) if entry.state == "waiting"), None)


def read_queue(path: Path) -> Queue:
    """Read a queue, an empty one where there is none; what ran when the window ended counts as stopped.

    Raises
    ------
    RecordingError
        The file holds no queue.
    """
    if not path.exists():
        return ()
    try:
        return tuple(_entry(told) for told in parse_json(read_input_text(path), path))
    except (InputError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise RecordingError(f"{path}: holds no queue ({error}); move it away to begin a new one") from error


def write_queue(queue: Queue, path: Path) -> None:
    """Write a queue in one step."""
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_text(path, json.dumps([asdict(entry) for entry in queue], indent=1, default=str) + "\n")


def _entry(told: dict[str, Any]) -> Entry:
    if told["state"] not in get_args(EntryState):
        raise ValueError(f"an entry is {told['state']!r}")
    trial = Trial(**{**told["trial"], "holds_s": tuple(told["trial"]["holds_s"])})
    entry = Entry(trial, told["state"], Path(told["session"]) if told["session"] else None, told["remark"])
    if entry.state == "running":
        return replace(entry, state="stopped", remark="the window was closed while it ran")
    return entry
