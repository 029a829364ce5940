"""Finding the messages of an MCAP file from its first byte on, whatever state the file is in.

Every chunk is compared with its checksum. Behind damage, reading goes on at the next chunk that can be read; what lies
between is told. The summary at the end of a sealed file only helps to tell what is missing, so a file that is still
being written, or was cut at any byte, reads like any other: of a chunk that the end of the file cuts off, every whole
message is found.
"""

import mmap
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Schema
from mcap.writer import MCAP0_MAGIC

from daq.errors import RecordingError
from daq.recording.scanning.chunk_reading import UnusableError, missing_of_chunk, remains_of_chunk
from daq.recording.scanning.leaving_out import leave_out_repeated, leave_out_unchecked
from daq.recording.scanning.recognition import Declared, recognise
from daq.recording.scanning.records import Record, read_record
from daq.recording.scanning.resuming import next_chunk, next_usable
from daq.recording.scanning.segments import RECORD, Damage, Scan, Segment
from daq.recording.scanning.summary import Summary, read_summary
from estimator.errors import InputError
from estimator.input_file import require_file

_DATA_END = (Opcode.DATA_END, 4)
_SHOWN_BYTES = 16


def scan(path: Path) -> Scan:
    """Scan a file of a session; raises RecordingError where it is none of MCAP."""
    trusted = Declared()
    result = _scanned(path, trusted)
    if result.mapped is not None:
        recognise(result, trusted)
    return result


def scan_foreign(path: Path) -> Scan:
    """Scan a file of another program, whose channels are what they are declared to be.

    Raises
    ------
    RecordingError
        It is no MCAP file.
    """
    return _scanned(path, Declared())


def _scanned(path: Path, trusted: Declared) -> Scan:
    """Return what is in a file, and fill in the declarations that a checksum agrees with."""
    result = _opened(path)
    if result.mapped is None:
        return result
    data = result.view
    summary = read_summary(data)
    if summary is not None:
        if summary.checked:
            trusted.channels.update(summary.channels)
            trusted.schemas.update(summary.schemas)
        result.schemas.update(summary.schemas)
        result.channels.update(summary.channels)
        result.summary_fault = summary.fault
    data_end = _scan_file(data, result, summary, trusted)
    leave_out_repeated(result)
    leave_out_unchecked(result, data_end)
    result.damages = _joined(result.damages)
    if not result.segments and data[: len(MCAP0_MAGIC)] != MCAP0_MAGIC and np.any(np.frombuffer(data, "u1")):
        start = bytes(data[:_SHOWN_BYTES])
        result.close()
        raise RecordingError(
            f"{path}: is no MCAP file; it begins with {start!r}, and no chunk of a recording is in it; put the right "
            "file there, or take it away and recover what the session holds beside it"
        )
    if summary is not None:
        _compare(summary, result)
    result.sealed = data_end is not None and summary is not None and not result.summary_fault
    return result


def scan_on(path: Path, before: Scan) -> Scan:
    """Scan what a file that is being written holds beyond an earlier scan of it, at first an empty one.

    Only whole chunks are taken, so that what is just being written is left to the next time. The channels and schemas
    are all that were declared so far.

    Raises
    ------
    RecordingError
        It is no file of MCAP, or damaged.
    """
    result = _opened(path)
    result.channels, result.schemas = dict(before.channels), dict(before.schemas)
    if result.mapped is None:
        return result
    data = result.view
    if data[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
        raise RecordingError(f"{path}: is no MCAP file; it begins with {bytes(data[:_SHOWN_BYTES])!r}")
    result.complete_bytes = position = max(len(MCAP0_MAGIC), before.complete_bytes)
    while position + RECORD.size <= len(data):
        if RECORD.unpack_from(data, position) == _DATA_END:
            summary = read_summary(data)
            result.sealed = summary is not None and summary.data_end == position and not summary.fault
            break
        try:
            record = read_record(data, position, frozenset())
        except UnusableError as error:
            if error.end is not None:
                raise RecordingError(f"{path}: {error}; the recording is damaged there") from error
            break
        if record.segment is not None and not _has_its_indexes(record.segment):
            break
        _take(record, result, Declared())
        position = result.complete_bytes = record.end
    return result


def has_its_indexes(found: Scan) -> bool:
    """Tell whether every message lies in a whole chunk with its message indexes behind it."""
    return all(_has_its_indexes(segment) for segment in found.segments)


def _has_its_indexes(segment: Segment) -> bool:
    return segment.index is not None and segment.index.message_index_offsets.keys() == segment.offsets.keys()


def _opened(path: Path) -> Scan:
    """Return a scan that has looked at nothing; without a mapping where the file is too short to be one."""
    try:
        size = require_file(path)
        with path.open("rb") as file:
            start = file.read(len(MCAP0_MAGIC))
            if size <= len(MCAP0_MAGIC):
                if not MCAP0_MAGIC.startswith(start) and any(start):
                    raise RecordingError(f"{path}: is no MCAP file; it begins with {start!r}")
                what = "nothing but the first bytes of a recording" if size else "the file is empty"
                whole = start == MCAP0_MAGIC
                return Scan(damages=[] if whole else [Damage(0, size, what)])
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except InputError as error:
        raise RecordingError(str(error)) from error
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error})") from error
    return Scan(mapped=mapped, view=memoryview(mapped))


def _scan_file(data: memoryview, result: Scan, summary: Summary | None, trusted: Declared) -> int | None:
    """Collect what can be used; return where the record lies that ends the data, None where there is none."""
    known_end = None if summary is None else summary.data_end
    begin_of_summary = None if summary is None else summary.begin
    limit = next(end for end in (known_end, begin_of_summary, len(data)) if end is not None)
    position, own_end = 0, None
    while position < limit:
        try:
            if position == 0:
                _check_magic(data)
                position = len(MCAP0_MAGIC)
                continue
            if RECORD.size <= limit - position and RECORD.unpack_from(data, position) == _DATA_END:
                if next_chunk(data[:limit], position) is None:
                    result.complete_bytes = position
                    return position
                raise UnusableError(f"the data seem to end at byte {position}, and do not")
            record = read_record(data, position, _loose(result))
            if record.end > limit:
                raise UnusableError(f"the record at byte {position} reaches into the summary")
            if record.segment is None and data[position] != Opcode.ATTACHMENT:
                _require_no_chunk_within(data[:limit], position, record.end)
            _take(record, result, trusted)
            position = record.end
            if not result.damages:
                result.complete_bytes = position
        except UnusableError as error:
            own_end = error.end
            begin = position
            position = next_usable(data, begin, own_end, limit, _loose(result))
            _leave_out(data, begin, position, str(error), result)
    return known_end


def _require_no_chunk_within(data: memoryview, start: int, end: int) -> None:
    """Refuse a record without a checksum whose length, or a piece that is gone of it, makes it reach over a chunk."""
    if next_chunk(data, start + 1, end) is not None:
        raise UnusableError(f"the record at byte {start} reaches over a chunk")


def _check_magic(data: memoryview) -> None:
    start = bytes(data[: len(MCAP0_MAGIC)])
    if start != MCAP0_MAGIC:
        raise UnusableError(f"the file begins with {start!r}", len(MCAP0_MAGIC))


def _loose(result: Scan) -> frozenset[int]:
    """Return the channels whose messages may lie outside of chunks: none in a file with chunks."""
    has_chunks = any(segment.index is not None for segment in result.segments[:1])
    return frozenset() if has_chunks else frozenset(result.channels)


def _take(record: Record, result: Scan, trusted: Declared) -> None:
    checked = record.segment is not None and record.segment.checked
    for declaration in record.declarations:
        if isinstance(declaration, Schema):
            result.schemas.setdefault(declaration.id, declaration)
            if checked:
                trusted.schemas.setdefault(declaration.id, declaration)
        elif isinstance(declaration, Channel):
            result.channels.setdefault(declaration.id, declaration)
            if checked:
                trusted.channels.setdefault(declaration.id, declaration)
        elif isinstance(declaration, Header):
            result.profile, result.library = declaration.profile, declaration.library
    if record.segment is not None and record.segment.offsets:
        result.segments.append(record.segment)
    if record.beside is not None:
        result.beside.append(record.beside)
    if record.fault:
        result.notes.append(record.fault)


def _leave_out(data: memoryview, start: int, end: int, what: str, result: Scan) -> None:
    """Note damage, but for the whole messages of a chunk that the end of the file cuts off."""
    is_chunk = data[start] == Opcode.CHUNK
    remains = remains_of_chunk(data, start) if is_chunk and end == len(data) else None
    missing = missing_of_chunk(data, start) if is_chunk and end == len(data) else 0
    if remains is not None:
        result.segments.append(remains)
        what = f"{what}; {sum(map(len, remains.offsets.values()))} whole messages of it are kept, without a checksum"
        start = remains.end
    elif not np.any(np.frombuffer(data[start:end], "u1")):
        what = "zeros"
    result.damages.append(Damage(start, end - start, what, missing))


def _joined(damages: list[Damage]) -> list[Damage]:
    """Return damages in the order of the file, those without anything between them as one."""
    joined: list[Damage] = []
    for damage in sorted(damages, key=lambda one: one.start):
        if joined and joined[-1].end >= damage.start:
            last = joined.pop()
            what = last.what if damage.what in last.what else f"{last.what}; {damage.what}"
            size = max(last.end, damage.end) - last.start
            repeated = last.repeated and damage.repeated
            joined.append(Damage(last.start, size, what, last.missing + damage.missing, repeated))
        else:
            joined.append(damage)
    return joined


def _compare(summary: Summary, result: Scan) -> None:
    """Compare a summary with what the file holds; keep its counts where a checksum agrees with them."""
    if summary.fault:
        return
    if summary.checked and summary.counts is not None:
        result.told_counts = summary.counts
    found = {
        one.index.chunk_start_offset: one.index.message_start_time
        for one in result.segments
        if one.index is not None
    }
    if not result.damages and summary.chunks and summary.chunks != found:
        result.summary_fault = "the summary tells of other chunks than there are"
