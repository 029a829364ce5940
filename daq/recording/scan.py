"""Finding the messages of an MCAP file from its first byte on, whatever state the file is in.

The summary at the end of a sealed file is not used, so a file that is still being written, or was cut at any byte,
reads like any other. Of a chunk that was cut off, every whole message is found; a chunk at the end that is whole but
damaged (its checksum is wrong, as after a loss of power) is left out.
"""

import mmap
import struct
import zlib
from collections import defaultdict
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Schema
from mcap.writer import MCAP0_MAGIC

from daq.errors import RecordingError
from daq.recording.damage import telling_damage
from daq.recording.segments import RECORD, Scan, Segment
from estimator.errors import InputError
from estimator.input_file import require_file
from robot_drivers.protocols import IntArray

_CHUNK = struct.Struct("<QQQII")
_MESSAGE = struct.Struct("<HIQQ")
_MESSAGE_INDEX = struct.Struct("<HI")
_FOOTER_SIZE = 29
_INDEX_ENTRY_SIZE = 16
_LAST_OPCODE = max(Opcode)
_MOST_CHUNK_BYTES = 1 << 30


def scan(path: Path) -> Scan:
    """Scan a file; raises RecordingError where it is none of MCAP."""
    result = _opened(path)
    with telling_damage(path):
        if result.mapped is not None:
            _scan_file(result.view, result)
        if not result.sealed:
            _leave_out_damaged(result)
    return result


def scan_on(path: Path, before: Scan) -> Scan:
    """Scan what a file that is being written holds beyond an earlier scan of it, at first an empty one.

    Only whole chunks are taken, so that what is just being written is left to the next time. The channels and schemas
    are all that were declared so far.

    Raises
    ------
    RecordingError
        It is no file of MCAP.
    """
    result = _opened(path)
    result.channels, result.schemas = dict(before.channels), dict(before.schemas)
    if result.mapped is not None:
        result.complete_bytes = max(result.complete_bytes, before.complete_bytes)
        with telling_damage(path):
            _scan_file(result.view, result)
    result.segments = [segment for segment in result.segments if segment.index is not None]
    return result


def _opened(path: Path) -> Scan:
    """Return a scan that has looked at nothing but the first bytes; without a mapping where there are not all."""
    try:
        require_file(path)
        with path.open("rb") as file:
            start = file.read(len(MCAP0_MAGIC))
            if not MCAP0_MAGIC.startswith(start):
                raise RecordingError(f"{path}: is no MCAP file; it begins with {start!r}")
            if len(start) < len(MCAP0_MAGIC):
                return Scan(lost_bytes=len(start))
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except InputError as error:
        raise RecordingError(str(error)) from error
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error})") from error
    return Scan(complete_bytes=len(MCAP0_MAGIC), mapped=mapped, view=memoryview(mapped))


def _scan_file(data: memoryview, result: Scan) -> None:
    """Go on collecting declarations and chunks up to the first incomplete record or the end of the data section."""
    position = result.complete_bytes
    while position + RECORD.size <= len(data):
        opcode, length = RECORD.unpack_from(data, position)
        body, end = position + RECORD.size, position + RECORD.size + length
        if opcode == Opcode.CHUNK and body + _CHUNK.size <= len(data):
            segment, end = _scan_chunk(data, position, min(end, len(data)), result)
            if segment.offsets:
                result.segments.append(segment)
            if segment.index is None:
                return
        elif opcode == Opcode.DATA_END:
            footer = data[-_FOOTER_SIZE - len(MCAP0_MAGIC) :]
            result.sealed = footer[0] == Opcode.FOOTER and footer[_FOOTER_SIZE:] == MCAP0_MAGIC
            return
        elif not 0 < opcode <= _LAST_OPCODE or end > len(data):
            break
        elif opcode == Opcode.MESSAGE:
            raise RecordingError("messages lie outside of chunks; another program wrote it, record anew")
        else:
            _declare(opcode, data[body:end], result)
        position = result.complete_bytes = end
    result.lost_bytes = len(data) - position


def _scan_chunk(data: memoryview, start: int, end: int, result: Scan) -> tuple[Segment, int]:
    """Return a chunk, and where its message indexes end; only what is left of it where they are not all there."""
    body = start + RECORD.size
    start_time, end_time, size, _, name_length = _CHUNK.unpack_from(data, body)
    records_start = body + _CHUNK.size + name_length + 8
    compression = bytes(data[body + _CHUNK.size : body + _CHUNK.size + name_length]).decode(
        "ascii", "replace"
    )
    stored = data[records_start:end]
    if end < body + RECORD.unpack_from(data, start)[1]:
        remains = _walk(stored, result) if not compression else Segment(stored[:0], {}, {}, None)
        result.lost_bytes = len(stored) - len(remains.data)
        return remains, start
    records = _uncompressed(stored, compression, size)
    indexes = _message_indexes(data, end)
    offsets, log_times = indexes.offsets, indexes.log_times
    if not indexes.followed or not offsets or not offsets.keys() <= result.channels.keys():
        walked = _walk(records, result)
        complete = {key: len(found) for key, found in offsets.items()} == {
            key: len(found) for key, found in walked.offsets.items()
        }
        if not indexes.followed and not complete:
            return walked, start
        offsets, log_times = walked.offsets, walked.log_times
    index = ChunkIndex(
        chunk_length=end - start,
        chunk_start_offset=start,
        compression=compression,
        compressed_size=len(stored),
        message_end_time=end_time,
        message_index_length=indexes.end - end,
        message_index_offsets=indexes.positions,
        message_start_time=start_time,
        uncompressed_size=size,
    )
    return Segment(records, offsets, log_times, index), indexes.end


@dataclass(slots=True)
class _MessageIndexes:
    """The message indexes behind a chunk, and whether another record follows them."""

    end: int
    offsets: dict[int, IntArray] = field(default_factory=dict)
    log_times: dict[int, IntArray] = field(default_factory=dict)
    positions: dict[int, int] = field(default_factory=dict)
    followed: bool = False


def _message_indexes(data: memoryview, position: int) -> _MessageIndexes:
    found = _MessageIndexes(position)
    while found.end + RECORD.size <= len(data):
        opcode, length = RECORD.unpack_from(data, found.end)
        body, after = found.end + RECORD.size, found.end + RECORD.size + length
        whole = after <= len(data) and (length - _MESSAGE_INDEX.size) % _INDEX_ENTRY_SIZE == 0
        if opcode != Opcode.MESSAGE_INDEX or not whole:
            found.followed = 0 < opcode <= _LAST_OPCODE and opcode != Opcode.MESSAGE_INDEX
            break
        channel, _ = _MESSAGE_INDEX.unpack_from(data, body)
        entries = np.frombuffer(data[body + _MESSAGE_INDEX.size : after], "<u8").reshape(-1, 2)
        found.log_times[channel], found.offsets[channel] = entries.astype(np.int64).T
        found.positions[channel] = found.end
        found.end = after
    return found


def _walk(records: memoryview, result: Scan) -> Segment:
    """Find the messages of a chunk one by one, up to the first that is incomplete."""
    offsets: defaultdict[int, list[int]] = defaultdict(list)
    log_times: defaultdict[int, list[int]] = defaultdict(list)
    position = 0
    while position + RECORD.size <= len(records):
        opcode, length = RECORD.unpack_from(records, position)
        body, end = position + RECORD.size, position + RECORD.size + length
        if not 0 < opcode <= _LAST_OPCODE or end > len(records):
            break
        if opcode == Opcode.MESSAGE:
            channel, _, log_time, _ = _MESSAGE.unpack_from(records, body)
            offsets[channel].append(position)
            log_times[channel].append(log_time)
        else:
            _declare(opcode, records[body:end], result)
        position = end
    return Segment(
        records[:position],
        {key: np.array(found) for key, found in offsets.items()},
        {key: np.array(found) for key, found in log_times.items()},
        None,
    )


def _leave_out_damaged(result: Scan) -> None:
    """Drop whole chunks at the end whose checksum is wrong."""
    while result.segments and (index := result.segments[-1].index) is not None:
        start = index.chunk_start_offset
        crc = _CHUNK.unpack_from(result.view, start + RECORD.size)[3]
        if crc == 0 or zlib.crc32(result.segments[-1].data) == crc:
            return
        result.lost_bytes += len(result.segments.pop().data)
        result.complete_bytes = start


def _declare(opcode: int, body: memoryview, result: Scan) -> None:
    stream = ReadDataStream(BytesIO(body))
    if opcode == Opcode.SCHEMA:
        schema = Schema.read(stream)
        result.schemas[schema.id] = schema
    elif opcode == Opcode.CHANNEL:
        channel = Channel.read(stream)
        result.channels[channel.id] = channel


def _uncompressed(stored: memoryview, compression: str, size: int) -> memoryview:
    if size > _MOST_CHUNK_BYTES:
        raise RecordingError(f"a chunk tells a size of {size} bytes; restore it from a copy")
    if compression == "zstd":
        return memoryview(zstandard.decompress(stored, max_output_size=size))
    if compression:
        raise RecordingError(f"a chunk is compressed by {compression!r}; recordings use zstd or nothing")
    return stored
