"""One record at the top level of an MCAP file: what it is, or why it cannot be used."""

import struct
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import TypeAlias

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema
from zlib_ng import zlib_ng

from daq.recording.mcap.log import encoded
from daq.recording.scanning.chunk_reading import UnusableError, read_chunk
from daq.recording.scanning.segments import RECORD, Segment
from daq.recording.scanning.walking import MESSAGE_HEAD

Declaration: TypeAlias = Header | Schema | Channel

_DECLARATIONS = {Opcode.HEADER: Header, Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel}
_CHECKSUM_SIZE = 4
_MOST_MESSAGE_BYTES = 1 << 30


@dataclass(frozen=True, slots=True)
class Record:
    """A usable record, or a run of messages outside of chunks.

    Attributes
    ----------
    end : the first byte behind it and behind the indexes that belong to it
    segment : the messages in it
    declarations : a header, schemas, channels
    beside : an attachment or metadata as it is in the file
    fault : what is not as it was written, and costs no message
    """

    end: int
    segment: Segment | None = None
    declarations: list[Declaration] = field(default_factory=list)
    beside: memoryview | None = None
    fault: str = ""


def read_record(data: memoryview, start: int, loose: frozenset[int]) -> Record:
    """Read what begins at a place.

    Parameters
    ----------
    loose : the channels whose messages may lie outside of chunks

    Raises
    ------
    UnusableError
        It is cut off, damaged, or no record.
    """
    if start + RECORD.size > len(data):
        raise UnusableError(f"the record at byte {start} is cut off")
    opcode, length = RECORD.unpack_from(data, start)
    end = start + RECORD.size + length
    if opcode == Opcode.CHUNK:
        segment, others, fault = read_chunk(data, start)
        declarations = [
            parsed
            for kind, body in others
            if kind in _DECLARATIONS and (parsed := parse_declaration(kind, body)) is not None
        ]
        return Record(segment.end, segment, declarations, fault=fault)
    if opcode not in (*_DECLARATIONS, Opcode.MESSAGE, Opcode.ATTACHMENT, Opcode.METADATA):
        is_known = 0 < opcode <= max(Opcode)
        what = "belongs elsewhere" if is_known else "is none"
        raise UnusableError(
            f"the record at byte {start} {what}", end if is_known and end <= len(data) else None
        )
    if end > len(data):
        raise UnusableError(f"the record at byte {start} is cut off, or its length is wrong")
    body = data[start + RECORD.size : end]
    if opcode == Opcode.MESSAGE:
        return _loose_messages(data, start, loose)
    if opcode == Opcode.ATTACHMENT:
        _check_attachment(body, start, end)
        return Record(end, beside=data[start:end])
    if opcode == Opcode.METADATA:
        if _parsed(Metadata, body) is None:
            raise UnusableError(f"the metadata at byte {start} are damaged", end)
        return Record(end, beside=data[start:end])
    declaration = parse_declaration(opcode, body)
    if declaration is None:
        raise UnusableError(f"the declaration at byte {start} is damaged", end)
    return Record(end, declarations=[declaration])


def parse_declaration(opcode: int, body: memoryview) -> Declaration | None:
    """Return a header, schema or channel, None where the bytes are not exactly one."""
    return _parsed(_DECLARATIONS[Opcode(opcode)], body)


def _parsed(kind: type[Declaration] | type[Metadata], body: memoryview) -> Declaration | None:
    """Parse a record; the library takes short ones, so what was read is written again and compared."""
    try:
        parsed = kind.read(ReadDataStream(BytesIO(body)))
        return parsed if encoded(parsed)[RECORD.size :] == body else None
    except (McapError, ValueError, struct.error, OverflowError):
        return None


def _check_attachment(body: memoryview, start: int, end: int) -> None:
    checksum = int.from_bytes(body[-_CHECKSUM_SIZE:], "little")
    if checksum and zlib_ng.crc32(body[:-_CHECKSUM_SIZE]) != checksum:
        raise UnusableError(f"CRC of the attachment at byte {start} disagrees", end)


def _loose_messages(data: memoryview, start: int, loose: frozenset[int]) -> Record:
    """Return all messages that follow one another from here on; as they lie outside of chunks, none has a checksum."""
    offsets: dict[int, list[int]] = {}
    log_times: dict[int, list[int]] = {}
    end = start
    while (head := loose_message(data, end, loose)) is not None:
        channel, log_time, after = head
        offsets.setdefault(channel, []).append(end - start)
        log_times.setdefault(channel, []).append(log_time)
        end = after
    if end == start:
        length = RECORD.unpack_from(data, start)[1]
        raise UnusableError(f"the message at byte {start} is of no channel", start + RECORD.size + length)
    segment = Segment(
        data[start:end],
        {key: np.array(found) for key, found in offsets.items()},
        {key: np.array(found, np.uint64).astype(np.int64) for key, found in log_times.items()},
        None,
        start,
        end,
        checked=False,
    )
    return Record(end, segment)


def loose_message(data: memoryview, start: int, loose: frozenset[int]) -> tuple[int, int, int] | None:
    """Return channel, time and end of the message at a place outside of chunks, None where there is none."""
    if start + RECORD.size + MESSAGE_HEAD.size > len(data):
        return None
    opcode, length = RECORD.unpack_from(data, start)
    end = start + RECORD.size + length
    if opcode != Opcode.MESSAGE or not MESSAGE_HEAD.size <= length <= _MOST_MESSAGE_BYTES or end > len(data):
        return None
    channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(data, start + RECORD.size)
    return (channel, log_time, end) if channel in loose else None


def without_last(segment: Segment) -> tuple[Segment | None, int]:
    """Return messages without the last of them, None where nothing is left, and where that one begins in the file."""
    last = max(int(offsets[-1]) for offsets in segment.offsets.values())
    if not last:
        return None, segment.start
    kept = {key: offsets[offsets < last] for key, offsets in segment.offsets.items()}
    kept = {key: offsets for key, offsets in kept.items() if len(offsets)}
    times = {key: segment.log_times[key][: len(offsets)] for key, offsets in kept.items()}
    end = segment.start + last
    return replace(segment, data=segment.data[:last], offsets=kept, log_times=times, end=end), end
