"""Writing what can be used of a damaged file to a new one, which takes its place once it was read back and compared."""

import errno
import os
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from mcap.records import ChunkIndex

from daq.errors import RecordingError
from daq.recording.mcap.chunks import chunk_head_bytes, encode_chunk, message_indexes
from daq.recording.mcap.log import preamble
from daq.recording.scanning.scan import scan
from daq.recording.scanning.segments import Scan, Segment
from daq.recording.sealing.ending import all_encoded, ending_of
from daq.recording.sync_names import sync_names


def draft_of(path: Path) -> Path:
    """Return where the new file is written; one that is left there is of an attempt that was interrupted."""
    return path.with_name(f".{path.name}.recovered")


def rewrite(path: Path, found: Scan) -> None:
    """Write what can be used to a new file, read that back, compare, and put it in the place of the old one.

    The scan of the old file is closed.

    Raises
    ------
    RecordingError
        The new file is not as it has to be, or finds no room; the old one is as it was.
    """
    draft = draft_of(path)
    try:
        with draft.open("wb") as file:
            _write_usable(file.write, found)
            file.flush()
            os.fsync(file.fileno())
        with scan(draft) as written:
            require_same(path, written, found.counts())
            _require_equal(path, written.segments, found.segments)
    except OSError as error:
        draft.unlink(missing_ok=True)
        if error.errno != errno.ENOSPC:
            raise
        raise RecordingError(
            f"{path}: is damaged, and the disk has no room for what can be saved of it, at most "
            f"{path.stat().st_size / 1e6:.0f} MB; make room and recover again; nothing was changed"
        ) from error
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
    found.close()  # no system may replace a mapped file
    draft.replace(path)
    sync_names(path.parent)


def _write_usable(write: Callable[[bytes | memoryview], int], found: Scan) -> None:
    """Write declarations, chunks as they are with new indexes, loose messages in chunks of their own, and a summary."""
    ending = ending_of(found)
    position = write(preamble())
    position += write(all_encoded([*ending.schemas, *ending.channels]))
    chunks = []
    for segment in found.segments:
        records, index = _chunk_of(segment, found, position)
        for part in records:
            position += write(part)
        chunks.append(index)
    for record in found.beside:
        position += write(record)
    write(replace(ending, chunks=chunks).written(position))


def _chunk_of(segment: Segment, found: Scan, position: int) -> tuple[list[bytes | memoryview], ChunkIndex]:
    """Return the chunk of a segment with a new head and new indexes, and how a summary names it there."""
    if segment.index is None:
        records, index = encode_chunk([segment.rows()], position)
        return [records], index
    old = segment.index
    end = old.chunk_start_offset + old.chunk_length
    stored = found.view[end - old.compressed_size : end]
    head = chunk_head_bytes(old, zlib.crc32(segment.data))
    length = len(head) + len(stored)
    indexes, offsets = message_indexes(segment.offsets, segment.log_times, position + length)
    index = replace(
        old,
        chunk_length=length,
        chunk_start_offset=position,
        message_index_length=len(indexes),
        message_index_offsets=offsets,
    )
    return [head, stored, indexes], index


def require_same(path: Path, sealed: Scan, counts: Mapping[str, int]) -> None:
    """Raise RecordingError unless a file is sealed, undamaged, and holds so many messages of each topic."""
    if sealed.faults or not sealed.sealed or _present(sealed.counts()) != _present(counts):
        raise RecordingError(
            f"{path}: holds {sealed.counts()} messages after sealing and {counts} before, with "
            f"{len(sealed.faults)} faults; look for a failing disk and run `retract recover` again"
        )


def _require_equal(path: Path, written: Sequence[Segment], found: Sequence[Segment]) -> None:
    """Raise RecordingError unless segments hold the same bytes."""
    if len(written) != len(found) or not all(
        np.array_equal(np.frombuffer(one.data, "u1"), np.frombuffer(other.data, "u1"))
        for one, other in zip(written, found, strict=True)
    ):
        raise RecordingError(
            f"{path}: what was read back from its recovered copy differs; look for a failing disk and run `retract "
            "recover` again; nothing was changed"
        )


def _present(counts: Mapping[str, int]) -> dict[str, int]:
    """Leave out topics without a message: one declared within a record that was cut off is not declared any more."""
    return {topic: count for topic, count in counts.items() if count}
