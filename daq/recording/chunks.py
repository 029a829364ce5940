"""Chunks: what a recording grows by, each with the index of its messages behind it.

MCAP specification, "Chunk (op=0x06)" and "Message Index (op=0x07)". Chunks here are not compressed: images are, before
they come here, and signals are small beside them.
"""

import struct
import zlib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode
from mcap.records import ChunkIndex

from robot_drivers.protocols import IntArray

_CHUNK = struct.Struct("<BQQQQIIQ")
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
    length = _CHUNK.size - _RECORD_PREFIX.size + len(data)
    chunk = _CHUNK.pack(Opcode.CHUNK, length, start_time, end_time, len(data), zlib.crc32(data), 0, len(data))
    records = [chunk, data]
    index_position = position + len(chunk) + len(data)
    offsets: dict[int, int] = {}
    for placed in indexes:
        offsets[placed.channel] = index_position
        records.append(_message_index(placed))
        index_position += len(records[-1])
    index = ChunkIndex(
        chunk_length=len(chunk) + len(data),
        chunk_start_offset=position,
        compression="",
        compressed_size=len(data),
        message_end_time=end_time,
        message_index_length=index_position - position - len(chunk) - len(data),
        message_index_offsets=offsets,
        message_start_time=start_time,
        uncompressed_size=len(data),
    )
    return b"".join(records), index


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
