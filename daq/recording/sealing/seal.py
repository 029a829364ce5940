"""Sealing: an unsealed MCAP file gets the index, statistics and footer that every tool reads.

The same code seals after a session and recovers after a crash. Where everything in a file can be used, nothing is
copied and no message is touched: the summary is appended. That takes megabytes, so a full disk is rarely too full for
it, and a second attempt begins where the first did. Of a damaged file, what can be used is written to a new one beside
it, which takes its place once it is on the disk, has been read back, and holds the same.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from daq.errors import RecordingError
from daq.recording.mcap.log import preamble
from daq.recording.scanning.scan import has_its_indexes, scan
from daq.recording.scanning.segments import Damage, Scan
from daq.recording.sealing.ending import Ending, ending_of
from daq.recording.sealing.losses import StreamLoss, losses
from daq.recording.sealing.rewriting import draft_of, require_same, rewrite

# of what is behind the last whole chunk, to be put back where sealing fails: many times what a recorder writes at once
_MOST_KEPT_BYTES = 256_000_000


@dataclass(frozen=True, slots=True)
class SealReport:
    """What sealing kept and left out.

    Attributes
    ----------
    counts : messages by topic that are in the file
    damages : what could not be used
    notes : what else was not as it was written
    lost : samples by stream that damage has cost
    unchecked : messages that are kept although no checksum covers them
    """

    counts: dict[str, int]
    damages: tuple[Damage, ...] = ()
    notes: tuple[str, ...] = ()
    lost: dict[str, StreamLoss] = field(default_factory=dict)
    unchecked: int = 0

    @property
    def dropped_bytes(self) -> int:
        """Bytes that could not be used."""
        return sum(damage.size for damage in self.damages)


def examine(path: Path, told: Mapping[str, int] | None = None) -> SealReport:
    """Report what sealing will keep of a file and leave out; nothing is changed.

    Parameters
    ----------
    told : messages of each topic that were in it, where a session tells; None where nothing is looked for that is
        missing without damage

    Raises
    ------
    RecordingError
        It is no MCAP file.
    """
    with scan(path) as found:
        return _report(found, told)


def seal(path: Path) -> SealReport:
    """Seal a file; a sealed one without a fault is left as it is.

    Raises
    ------
    RecordingError
        The sealed file does not hold what was found in the unsealed one, which is as it was; or the disk has no room.
    """
    draft_of(path).unlink(missing_ok=True)
    with scan(path) as found:
        report = _report(found, None)
        in_place = not found.damages and not found.notes and has_its_indexes(found)
        if in_place and found.sealed:
            return report
        if not in_place:
            rewrite(path, found)
            return report
        ending = ending_of(found)
        start = found.complete_bytes
    # from here on the file is not mapped into memory any more: no system may cut a mapped file
    _append(path, start, ending, report.counts)
    return report


def _report(found: Scan, told: Mapping[str, int] | None) -> SealReport:
    lost = losses(found, told or {}) if told is not None or found.damages else {}
    unchecked = sum(sum(map(len, one.offsets.values())) for one in found.segments if not one.checked)
    notes = [*found.notes, *([found.summary_fault] if found.summary_fault else [])]
    return SealReport(found.counts(), tuple(found.damages), tuple(notes), lost, unchecked)


def _append(path: Path, start: int, ending: Ending, counts: Mapping[str, int]) -> None:
    """Write the summary behind the last record, over what there may be of one, or put back what was there."""
    begun = start >= len(preamble())
    with path.open("r+b") as file:
        position = file.seek(start if begun else 0)
        replaced = file.read(_MOST_KEPT_BYTES)
        file.seek(position)
        written = (b"" if begun else preamble()) + ending.written(position if begun else len(preamble()))
        file.write(written)
        file.truncate()
        file.flush()
        os.fsync(file.fileno())
    try:
        with scan(path) as sealed:
            require_same(path, sealed, counts)
    except RecordingError:
        with path.open("r+b") as file:
            file.seek(position)
            file.write(replaced)
            file.truncate()
        raise
