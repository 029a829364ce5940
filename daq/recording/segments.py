"""What is found in an MCAP file: the uncompressed records of its chunks, and where the messages lie in them."""

import mmap
import struct
from dataclasses import dataclass, field

import numpy as np
from mcap.records import Channel, ChunkIndex, Schema

from daq.recording.chunks import Placed, Rows
from robot_drivers.closing import ClosedAtExit
from robot_drivers.protocols import IntArray

# Opcode and length of a record's body.
RECORD = struct.Struct("<BQ")


@dataclass(frozen=True, slots=True)
class Segment:
    """The uncompressed records of a chunk, and where its messages lie.

    Attributes
    ----------
    offsets, log_times : for each channel id the offsets of its records' opcodes and their times, in file order
    index : how a summary names the chunk; None for what is left of one that was cut off
    """

    data: memoryview
    offsets: dict[int, IntArray]
    log_times: dict[int, IntArray]
    index: ChunkIndex | None

    def rows(self) -> Rows:
        """Return a copy of the whole messages, to be put into a chunk of their own."""
        placed = tuple(Placed(key, self.log_times[key], offsets) for key, offsets in self.offsets.items())
        return Rows((bytes(self.data),), placed)


@dataclass(slots=True)
class Scan(ClosedAtExit):
    """What a file holds; a context manager that ends the mapping of the file into memory.

    Attributes
    ----------
    segments : in file order
    channels, schemas : by id
    complete_bytes : how far the file consists of whole chunks and declarations
    lost_bytes : of records at the end that are incomplete or damaged
    sealed : whether it ends with a summary
    mapped, view : the file in memory; None and empty for one too short
    """

    segments: list[Segment] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    complete_bytes: int = 0
    lost_bytes: int = 0
    sealed: bool = False
    mapped: mmap.mmap | None = None
    view: memoryview = field(default_factory=lambda: memoryview(b""))

    def channel_id(self, topic: str) -> int | None:
        """Return the id of a topic's channel, None where the file has none."""
        return next((key for key, channel in self.channels.items() if channel.topic == topic), None)

    def records(self, channel_id: int) -> list[memoryview]:
        """Return the message records of a channel, opcode and length included, in file order."""
        found: list[memoryview] = []
        for segment in self.segments:
            data = segment.data
            for offset in segment.offsets.get(channel_id, np.empty(0, np.int64)).tolist():
                length = RECORD.unpack_from(data, offset)[1]
                found.append(data[offset : offset + RECORD.size + length])
        return found

    def equal_records(self, channel_id: int, size: int) -> bytes:
        """Return the message records of a channel end to end; raises ValueError unless each has ``size`` bytes."""
        parts: list[bytes] = []
        for segment in self.segments:
            offsets = segment.offsets.get(channel_id)
            if offsets is None:
                continue
            if int(offsets.max()) + size > len(segment.data):
                raise ValueError(f"a record is shorter than {size} bytes")
            # a row for every place where a record could begin; rows overlap, nothing is copied but those chosen
            beginnings = len(segment.data) - size + 1
            records = np.ndarray((beginnings,), np.dtype((np.void, size)), segment.data, strides=(1,))[
                offsets
            ]
            octets = records.view(np.uint8).reshape(-1, size)
            lengths = np.ascontiguousarray(octets[:, 1:9]).view("<u8")
            if np.any(lengths != size - RECORD.size):
                raise ValueError(f"a record has not {size} bytes")
            parts.append(records.tobytes())
        return b"".join(parts)

    def counts(self) -> dict[str, int]:
        """Return the number of messages of each topic."""
        return {
            channel.topic: sum(len(segment.offsets.get(key, ())) for segment in self.segments)
            for key, channel in self.channels.items()
        }

    def close(self) -> None:
        """End the mapping; nothing that was found may be used any more."""
        for segment in self.segments:
            segment.data.release()
        self.segments.clear()
        self.view.release()
        if self.mapped is not None:
            self.mapped.close()
