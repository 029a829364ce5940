"""The sessions of a folder, as a list that can be filtered."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

from daq.errors import RecordingError
from daq.recording.folder import INFO_FILE, RIG_FILE, SessionInfo, read_info
from daq.recording.in_use import is_in_use
from daq.recording.layout import SIGNALS_FILE

Condition = Literal["recording", "sealing", "cut off", "sealed", "recovered", "unreadable"]


@dataclass(frozen=True, slots=True)
class SessionEntry:
    """One session folder.

    Attributes
    ----------
    info : what it says of itself; None where that cannot be read
    condition : as it stands; one that is cut off can be repaired, one that is being sealed is left to who does it
    trouble : why it cannot be read; empty where it can
    """

    folder: Path
    info: SessionInfo | None
    condition: Condition
    trouble: str = ""

    @property
    def finished(self) -> bool:
        """Whether experiments can be made of it."""
        return self.condition in ("sealed", "recovered")

    @property
    def trajectory(self) -> str:
        """The kind of its trajectory, in words."""
        kind = "" if self.info is None else str(self.info.trajectory.get("kind", ""))
        return kind.replace("_", " ")

    @property
    def started(self) -> str:
        """When it was begun, local time."""
        if self.info is None:
            return ""
        moment = datetime.fromtimestamp(self.info.clock_anchor.wall_time_ns * 1e-9).astimezone()
        return f"{moment:%Y-%m-%d %H:%M:%S}"


def find_sessions(folder: Path) -> tuple[SessionEntry, ...]:
    """Return the sessions in a folder, the newest first; there may be none, and no folder."""
    entries = [entry_of(file.parent) for file in folder.glob(f"*/{INFO_FILE}")]
    return tuple(
        sorted(entries, key=lambda e: (0 if e.info is None else -e.info.clock_anchor.wall_time_ns, e.folder))
    )


def entry_of(folder: Path) -> SessionEntry:
    """Return the entry of one session folder."""
    try:
        # asked first: whoever seals it lets go of it after it has become a sealed one
        held = (folder / RIG_FILE).exists() and is_in_use(folder / RIG_FILE)
        info = read_info(folder)
    except (RecordingError, OSError) as error:
        return SessionEntry(folder, None, "unreadable", str(error))
    if info.state != "recording":
        return SessionEntry(folder, info, info.state)
    try:
        written = is_in_use(folder / SIGNALS_FILE)
    except OSError as error:
        return SessionEntry(folder, info, "unreadable", f"{folder / SIGNALS_FILE}: {error.strerror or error}")
    return SessionEntry(folder, info, "recording" if written else "sealing" if held else "cut off")


def matching(entries: Sequence[SessionEntry], text: str, condition: str = "") -> tuple[SessionEntry, ...]:
    """Return the entries that hold every word of a text in name, phantom, trajectory, operator or notes.

    ``condition`` leaves those in that condition alone; empty for all.
    """
    words = text.lower().split()
    return tuple(
        entry
        for entry in entries
        if (not condition or entry.condition == condition) and all(word in _searched(entry) for word in words)
    )


def _searched(entry: SessionEntry) -> str:
    info = entry.info
    told = () if info is None else (info.name, info.phantom_id, info.operator, info.notes)
    return " ".join((entry.folder.name, entry.trajectory, *told)).lower()
