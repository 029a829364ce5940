"""Chunks: what a recording grows by, each with the index of its messages behind it.

MCAP specification, "Chunk (op=0x06)" and "Message Index (op=0x07)". Chunks here are not compressed: images are, before
they come here, and signals are small beside them.
"""

import struct
import zlib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode
from mcap.records import ChunkIndex

from robot_drivers.protocols import IntArray

# opcode, length, times of the first and the last message, uncompressed size, CRC, length of the compression's name
_HEAD = struct.Struct("<BQQQQII")
_SIZE = struct.Struct("<Q")
_RECORD_PREFIX = struct.Struct("<BQ")
_MESSAGE_INDEX = struct.Struct("<BQHI")


@dataclass(frozen=True, slots=True)
class Placed:
    """Messages of one channel in some rows: their times and the offsets of their records, both (n,)."""

    channel: int
    log_time: IntArray
    offset: IntArray


@dataclass(frozen=True, slots=True)
class Rows:
    """Whole message records: their bytes, in parts to be laid end to end, and where each message lies."""

    parts: tuple[bytes | memoryview, ...]
    placed: tuple[Placed, ...]

    @property
    def size(self) -> int:
        """Bytes in all."""
        return sum(memoryview(part).nbytes for part in self.parts)


def encode_chunk(batch: Sequence[Rows], position: int) -> tuple[bytes, ChunkIndex]:
    """Return the records of a chunk and of its message indexes, and how a summary names the chunk.

    Parameters
    ----------
    batch : in the order of the file; together at least one message
    position : of the chunk in the file
    """
    data = b"".join(part for rows in batch for part in rows.parts)
    indexes = _merged(batch)
    start_time = min(int(placed.log_time.min()) for placed in indexes)
    end_time = max(int(placed.log_time.max()) for placed in indexes)
    length = _HEAD.size + _SIZE.size + len(data)
    index_records, offsets = message_indexes(
        {placed.channel: placed.offset for placed in indexes},
        {placed.channel: placed.log_time for placed in indexes},
        position + length,
    )
    index = ChunkIndex(
        chunk_length=length,
        chunk_start_offset=position,
        compression="",
        compressed_size=len(data),
        message_end_time=end_time,
        message_index_length=len(index_records),
        message_index_offsets=offsets,
        message_start_time=start_time,
        uncompressed_size=len(data),
    )
    return b"".join([chunk_head_bytes(index, zlib.crc32(data)), data, index_records]), index


def chunk_head_bytes(index: ChunkIndex, checksum: int) -> bytes:
    """Return what stands before the records of a chunk.

    Parameters
    ----------
    checksum : CRC-32 of the uncompressed records
    """
    name = index.compression.encode()
    length = _HEAD.size - _RECORD_PREFIX.size + len(name) + _SIZE.size + index.compressed_size
    times = index.message_start_time, index.message_end_time
    head = _HEAD.pack(Opcode.CHUNK, length, *times, index.uncompressed_size, checksum, len(name))
    return head + name + _SIZE.pack(index.compressed_size)


def message_indexes(
    offsets: Mapping[int, IntArray], log_times: Mapping[int, IntArray], position: int
) -> tuple[bytes, dict[int, int]]:
    """Return the message indexes of a chunk, and where that of each channel lies in the file.

    Parameters
    ----------
    offsets, log_times : of the messages of each channel id, as in :class:`Placed`
    position : of the indexes in the file
    """
    records = b""
    places: dict[int, int] = {}
    for channel in offsets:
        places[channel] = position + len(records)
        records += _message_index(Placed(channel, log_times[channel], offsets[channel]))
    return records, places


def _merged(batch: Sequence[Rows]) -> list[Placed]:
    """Return one index for each channel, with offsets from the start of the chunk's data."""
    found: defaultdict[int, list[Placed]] = defaultdict(list)
    base = 0
    for rows in batch:
        for placed in rows.placed:
            found[placed.channel].append(Placed(placed.channel, placed.log_time, placed.offset + base))
        base += rows.size
    return [
        Placed(
            channel,
            np.concatenate([part.log_time for part in parts]),
            np.concatenate([part.offset for part in parts]),
        )
        for channel, parts in found.items()
    ]


def _message_index(placed: Placed) -> bytes:
    entries = np.column_stack([placed.log_time, placed.offset]).astype("<u8").tobytes()
    length = _MESSAGE_INDEX.size - _RECORD_PREFIX.size + len(entries)
    return _MESSAGE_INDEX.pack(Opcode.MESSAGE_INDEX, length, placed.channel, len(entries)) + entries
