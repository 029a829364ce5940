"""One chunk of an MCAP file: taken apart, decompressed, and compared with its checksum and its message indexes.

Nothing that a chunk's head or an index says is believed: the checksum covers the records alone, so a length that was
damaged is looked for among its copies, and an index counts only where its messages fill the chunk without a gap.
"""

import struct
from dataclasses import dataclass, field

import lz4.frame
import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import ChunkIndex
from zlib_ng import zlib_ng

from daq.recording.messages.rows import RECORD as MESSAGE_RECORD
from daq.recording.scanning.segments import RECORD, Segment, heads_at
from daq.recording.scanning.walking import MESSAGE_HEAD, Walk, walk
from robot_drivers.protocols import IntArray

_HEAD = struct.Struct("<QQQII")
_SIZE = struct.Struct("<Q")
_MESSAGE_INDEX = struct.Struct("<HI")
_WHOLE_HEAD = struct.Struct("<BQHIQQ")
_INDEX_ENTRY_SIZE = 16
_MOST_CHUNK_BYTES = 1 << 30
_COMPRESSIONS = {b"": 0, b"lz4": 3, b"zstd": 4}


class UnusableError(Exception):
    """A record that cannot be used; the text says what was found. Never leaves this package.

    Attributes
    ----------
    end : where the record ends by its own account; None where that cannot be
    """

    def __init__(self, what: str, end: int | None = None) -> None:
        super().__init__(what)
        self.end = end


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """What stands before the records of a chunk: times of its first and last message, and what it says of its records.

    ``sizes`` are the bytes of its stored records by its own two or three accounts.
    """

    start: int
    times: tuple[int, int]
    uncompressed_size: int
    checksum: int
    compression: str
    records_start: int
    sizes: tuple[int, ...]


def chunk_head(data: memoryview, start: int) -> ChunkHead:
    """Read the head of the chunk at a place where its opcode stands.

    Raises
    ------
    UnusableError
        There is no such head.
    """
    body = start + RECORD.size
    if body + _HEAD.size + _SIZE.size > len(data):
        raise UnusableError(f"the chunk at byte {start} is cut off in its head")
    length: int = RECORD.unpack_from(data, start)[1]
    begin, end, uncompressed_size, checksum, name_length = _HEAD.unpack_from(data, body)
    name = bytes(data[body + _HEAD.size : body + _HEAD.size + min(name_length, 8)])
    sizes_from = body + _HEAD.size + name_length
    if _COMPRESSIONS.get(name) != name_length:
        raise UnusableError(f"the chunk at byte {start} tells a compression {name!r} that there is none of")
    if sizes_from + _SIZE.size > len(data):
        raise UnusableError(f"the chunk at byte {start} is cut off in its head")
    records_start = sizes_from + _SIZE.size
    told = [length - (records_start - body), _SIZE.unpack_from(data, sizes_from)[0]]
    if not name:
        told.append(uncompressed_size)
    return ChunkHead(
        start, (begin, end), uncompressed_size, checksum, name.decode(), records_start, tuple(told)
    )


def read_chunk(data: memoryview, start: int) -> tuple[Segment, list[tuple[int, memoryview]], str]:
    """Read a chunk; return it, the opcodes and bodies of its other records, and a fault of its indexes, or nothing.

    Raises
    ------
    UnusableError
        It is cut off, or its checksum disagrees with its records, or they are none.
    """
    head = chunk_head(data, start)
    size, records = _checked_records(data, head)
    end = head.records_start + size
    indexes = _message_indexes(data, end)
    placed = _fitting(records, indexes)
    others: list[tuple[int, memoryview]] = []
    fault = ""
    if placed is None:
        walked = walk(records)
        if walked.end != len(records):
            raise UnusableError(f"the chunk at byte {start} holds no records behind its byte {walked.end}")
        placed, others = (walked.offsets, walked.log_times), walked.others
        if not indexes.agree(placed[0]):
            # a wrong index may reach into the next chunk: it is left to whoever goes on behind the chunk
            indexes = _MessageIndexes(end)
    offsets, log_times = placed
    times = [int(time) for each in log_times.values() for time in (each.min(), each.max())]
    begin_end = min(times, default=0), max(times, default=0)
    if times and (head.times != begin_end or len(set(head.sizes)) != 1):
        fault = f"the head of the chunk at byte {start} disagrees with its records"
    index = ChunkIndex(
        chunk_length=end - start,
        chunk_start_offset=start,
        compression=head.compression,
        compressed_size=size,
        message_end_time=begin_end[1],
        message_index_length=indexes.end - end,
        message_index_offsets=indexes.positions,
        message_start_time=begin_end[0],
        uncompressed_size=len(records),
    )
    checked = head.checksum != 0
    return Segment(records, offsets, log_times, index, start, indexes.end, checked), others, fault


def _checked_records(data: memoryview, head: ChunkHead) -> tuple[int, memoryview]:
    """Return the stored size and the uncompressed records that agree with the chunk's checksum."""
    place = f"the chunk at byte {head.start}"
    agreed = len(set(head.sizes)) == 1
    own_end = head.records_start + head.sizes[0]
    reason = f"{place} is cut off"
    for size in dict.fromkeys(head.sizes):
        if size < 0 or head.records_start + size > len(data):
            continue
        stored = data[head.records_start : head.records_start + size]
        try:
            records = _uncompressed(stored, head)
        except (ValueError, RuntimeError, EOFError, zstandard.ZstdError) as error:
            reason = f"{place} cannot be decompressed ({error})"
            continue
        if head.checksum == 0 and agreed:
            return size, records
        if head.checksum != 0 and zlib_ng.crc32(records) == head.checksum:
            return size, records
        reason = f"CRC of {place} disagrees"
    if not agreed and reason.endswith("cut off"):
        reason = f"{place} tells lengths that disagree"
    raise UnusableError(reason, own_end if own_end <= len(data) else None)


def _uncompressed(stored: memoryview, head: ChunkHead) -> memoryview:
    if not head.compression:
        return stored
    size = head.uncompressed_size
    if size > _MOST_CHUNK_BYTES:
        raise ValueError(f"it tells a size of {size} bytes")
    if head.compression == "zstd":
        told = zstandard.frame_content_size(stored)
        if told not in (-1, size):
            raise ValueError(f"{told} bytes instead of {size}")
        data = zstandard.ZstdDecompressor().decompress(stored, max_output_size=max(size, 1))
    else:
        data = lz4.frame.LZ4FrameDecompressor().decompress(stored, max_length=size + 1)
    if len(data) != size:
        raise ValueError(f"{len(data)} bytes instead of {size}")
    return memoryview(data)


@dataclass(slots=True)
class _MessageIndexes:
    """The message indexes behind a chunk, whose end is the end of the last of them."""

    end: int
    offsets: dict[int, IntArray] = field(default_factory=dict)
    log_times: dict[int, IntArray] = field(default_factory=dict)
    positions: dict[int, int] = field(default_factory=dict)

    def agree(self, offsets: dict[int, IntArray]) -> bool:
        """Tell whether they name these messages; without any of them there is nothing to disagree."""
        named = {key: sorted(found.tolist()) for key, found in self.offsets.items() if len(found)}
        return not named or named == {key: found.tolist() for key, found in offsets.items()}


def _message_indexes(data: memoryview, position: int) -> _MessageIndexes:
    found = _MessageIndexes(position)
    while found.end + RECORD.size <= len(data):
        opcode, length = RECORD.unpack_from(data, found.end)
        body, after = found.end + RECORD.size, found.end + RECORD.size + length
        whole = after <= len(data) and (length - _MESSAGE_INDEX.size) % _INDEX_ENTRY_SIZE == 0
        if opcode != Opcode.MESSAGE_INDEX or not whole or length < _MESSAGE_INDEX.size:
            break
        channel, size = _MESSAGE_INDEX.unpack_from(data, body)
        if size != length - _MESSAGE_INDEX.size or channel in found.positions:
            break
        entries = np.frombuffer(data[body + _MESSAGE_INDEX.size : after], "<u8").reshape(-1, 2)
        found.log_times[channel], found.offsets[channel] = entries.astype(np.int64).T
        found.positions[channel] = found.end
        found.end = after
    return found


def _fitting(
    records: memoryview, indexes: _MessageIndexes
) -> tuple[dict[int, IntArray], dict[int, IntArray]] | None:
    """Return offsets and times by the indexes where their messages fill the records, None where they do not."""
    found = {key: offsets for key, offsets in indexes.offsets.items() if len(offsets)}
    if not found:
        return None
    offsets = np.concatenate(list(found.values()))
    if offsets.min() < 0 or offsets.max() + MESSAGE_RECORD.itemsize > len(records):
        return None
    counts = [len(part) for part in found.values()]
    steps = np.diff(offsets)
    steps[np.cumsum(counts)[:-1] - 1] = 1  # from one channel to the next
    if len(steps) and steps.min() <= 0:
        return None
    channels = np.repeat(list(found), counts)
    log_times = np.concatenate([indexes.log_times[key] for key in found])
    order = offsets.argsort(kind="stable")
    offsets = offsets[order]
    heads = heads_at(records, offsets)
    ends = offsets + heads["length"].astype(np.int64) + RECORD.size
    fits = (
        offsets[0] == 0
        and ends[-1] == len(records)
        and (ends[:-1] == offsets[1:]).all()
        and (heads["opcode"] == Opcode.MESSAGE).all()
        and (heads["channel"] == channels[order]).all()
        and (heads["log_time"].astype(np.int64) == log_times[order]).all()
    )
    return (found, {key: indexes.log_times[key] for key in found}) if fits else None


def remains_of_chunk(data: memoryview, start: int) -> Segment | None:
    """Return the whole messages of an uncompressed chunk that the end of the file cuts off, None where there are none.

    They have no checksum. That the file was cut, and not changed, is seen from the message that the cut goes through:
    it, too, begins as one of its channel does.
    """
    try:
        head = chunk_head(data, start)
    except UnusableError:
        return None
    if head.compression or len(set(head.sizes)) != 1 or head.records_start + head.sizes[0] <= len(data):
        return None
    records = data[head.records_start :]
    walked = walk(records)
    if not walked.offsets or not _is_cut_message(records, walked):
        return None
    end = head.records_start + walked.end
    return Segment(records[: walked.end], walked.offsets, walked.log_times, None, start, end, checked=False)


def missing_of_chunk(data: memoryview, start: int) -> int:
    """Return how many bytes of the chunk at this place are behind the end of the file, 0 where none or unknown."""
    try:
        head = chunk_head(data, start)
    except UnusableError:
        return 0
    agreed = len(set(head.sizes)) == 1 and head.sizes[0] <= _MOST_CHUNK_BYTES
    return max(0, head.records_start + head.sizes[0] - len(data)) if agreed else 0


def _is_cut_message(records: memoryview, walked: Walk) -> bool:
    """Tell whether what follows the last whole record of a chunk is the beginning of another message of it."""
    rest = records[walked.end :]
    if len(rest) < MESSAGE_RECORD.itemsize:
        # too short to be looked at; what comes before it may be changed only where this is no opcode
        return not len(rest) or (rest[0] == Opcode.MESSAGE)
    opcode, length, channel, sequence, log_time, publish_time = _WHOLE_HEAD.unpack_from(rest)
    before = walked.offsets.get(channel)
    if opcode != Opcode.MESSAGE or length < MESSAGE_HEAD.size or log_time != publish_time:
        return False
    if before is None:
        return bool(length <= _MOST_CHUNK_BYTES)
    last = _WHOLE_HEAD.unpack_from(records, int(before[-1]))
    return bool(0 < (sequence - last[3]) % 2**32 < 2**31 and log_time >= last[4])
