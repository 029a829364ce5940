"""What is found in an MCAP file: the uncompressed records of its chunks, and where the messages lie in them."""

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from mcap.records import Channel, ChunkIndex, Schema
from numpy.typing import NDArray

from daq.recording.mcap.chunks import Placed, Rows
from daq.recording.messages.rows import RECORD as MESSAGE_RECORD
from robot_drivers.closing import ClosedAtExit
from robot_drivers.protocols import IntArray

# Opcode and length of a record's body.
RECORD = struct.Struct("<BQ")


@dataclass(frozen=True, slots=True)
class Damage:
    """A stretch of a file that cannot be used.

    Attributes
    ----------
    start, size : where it is, bytes
    what : what was found there
    missing : bytes that records there tell of and that the file does not have
    repeated : whether the same records are elsewhere in the file, so that nothing is lost with it
    """

    start: int
    size: int
    what: str
    missing: int = 0
    repeated: bool = False

    @property
    def end(self) -> int:
        """The first byte behind it."""
        return self.start + self.size


@dataclass(frozen=True, slots=True)
class Segment:
    """The uncompressed records of a chunk, and where its messages lie.

    Attributes
    ----------
    offsets, log_times : for each channel id the offsets of its records' opcodes and their times, in file order
    index : how a summary names the chunk; None for messages outside of a whole chunk
    start : of the chunk, or of the first message, in the file
    end : the first byte behind the chunk's indexes, or behind the last message
    checked : whether a checksum agrees with the records; False where the file has none
    """

    data: memoryview
    offsets: dict[int, IntArray]
    log_times: dict[int, IntArray]
    index: ChunkIndex | None
    start: int
    end: int
    checked: bool

    def rows(self) -> Rows:
        """Return a copy of the whole messages, to be put into a chunk of their own."""
        placed = tuple(Placed(key, self.log_times[key], offsets) for key, offsets in self.offsets.items())
        return Rows((bytes(self.data),), placed)

    def heads(self, channel_id: int) -> NDArray[np.void]:
        """Return opcode, length, channel, sequence and times of a channel's messages, (n,)."""
        offsets = self.offsets.get(channel_id)
        if offsets is None or not len(offsets):
            return np.empty(0, MESSAGE_RECORD)
        return heads_at(self.data, offsets)


@dataclass(slots=True)
class Scan(ClosedAtExit):
    """What a file holds; a context manager that ends the mapping of the file into memory.

    Attributes
    ----------
    segments : in file order
    channels, schemas : by id
    beside : attachments and metadata as they are in the file: their records, opcode and length included
    profile, library : what the file's header says
    complete_bytes : how far the file consists of whole records
    damages : in file order; each stretch ends where the next usable record begins
    notes : what else is not as it was written, and costs no message
    summary_fault : why the summary at the end cannot be trusted; empty where there is none, or nothing wrong with it
    told_counts : messages by channel id, as a summary tells that agrees with its checksum; None without one
    sealed : whether it ends with a summary that can be trusted
    mapped, view : the file in memory; None and empty for one too short
    """

    segments: list[Segment] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    beside: list[memoryview] = field(default_factory=list)
    profile: str = ""
    library: str = ""
    complete_bytes: int = 0
    damages: list[Damage] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    summary_fault: str = ""
    told_counts: dict[int, int] | None = None
    sealed: bool = False
    mapped: mmap.mmap | None = None
    view: memoryview = field(default_factory=lambda: memoryview(b""))

    @property
    def faults(self) -> list[str]:
        """What is wrong with the file, one line each; empty for one that is as it was written."""
        return [
            *(f"bytes {one.start} to {one.end}: {one.what}" for one in self.damages),
            *self.notes,
            *([self.summary_fault] if self.summary_fault else []),
        ]

    def channel_ids(self, topic: str) -> list[int]:
        """Return the ids of all channels of a topic; other programs may have declared it more than once."""
        return [key for key, channel in self.channels.items() if channel.topic == topic]

    def records(self, topic: str) -> list[memoryview]:
        """Return the message records of a topic, opcode and length included, in file order."""
        found: list[memoryview] = []
        for segment, key in self._parts(topic):
            data = segment.data
            for offset in segment.offsets[key].tolist():
                length = RECORD.unpack_from(data, offset)[1]
                found.append(data[offset : offset + RECORD.size + length])
        return found

    def equal_records(self, topic: str, size: int) -> bytes:
        """Return the message records of a topic end to end; raises ValueError unless each has ``size`` bytes."""
        parts: list[bytes] = []
        for segment, key in self._parts(topic):
            offsets = segment.offsets[key]
            if int(offsets.max()) + size > len(segment.data):
                raise ValueError(f"a record is shorter than {size} bytes")
            records = _views_of(segment.data, np.dtype((np.void, size)))[offsets]
            octets = records.view(np.uint8).reshape(-1, size)
            lengths = np.ascontiguousarray(octets[:, 1:9]).view("<u8")
            if np.any(lengths != size - RECORD.size):
                raise ValueError(f"a record has not {size} bytes")
            parts.append(records.tobytes())
        return b"".join(parts)

    def counts(self) -> dict[str, int]:
        """Return the number of messages of each topic."""
        return {
            channel.topic: sum(
                len(segment.offsets.get(key, ()))
                for key in self.channel_ids(channel.topic)
                for segment in self.segments
            )
            for channel in self.channels.values()
        }

    def counts_by_channel(self) -> dict[int, int]:
        """Return the number of messages of each channel."""
        return {
            key: sum(len(segment.offsets.get(key, ())) for segment in self.segments) for key in self.channels
        }

    def close(self) -> None:
        """End the mapping; nothing that was found may be used any more."""
        for segment in self.segments:
            segment.data.release()
        self.segments.clear()
        for record in self.beside:
            record.release()
        self.beside.clear()
        self.view.release()
        if self.mapped is not None:
            self.mapped.close()

    def _parts(self, topic: str) -> Iterator[tuple[Segment, int]]:
        """Yield the segments with messages of a topic, and the channel that they are on."""
        keys = self.channel_ids(topic)
        for segment in self.segments:
            for key in keys:
                if len(segment.offsets.get(key, ())):
                    yield segment, key


def heads_at(data: memoryview, offsets: IntArray) -> NDArray[np.void]:
    """Return the heads of the message records that begin at these offsets, (n,); they must lie within the data."""
    return _views_of(data, MESSAGE_RECORD)[offsets]


def _views_of(data: memoryview, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Return a row for every place where a record could begin; rows overlap, nothing is copied but those chosen."""
    return np.ndarray((len(data) - dtype.itemsize + 1,), dtype, data, strides=(1,))
