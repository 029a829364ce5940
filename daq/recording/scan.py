"""Finding the messages of an MCAP file from its first byte on, whatever state the file is in.

The index at the end of a sealed file is not used, so a file that is still being written, or was cut at any byte,
reads like any other: everything up to the first incomplete record.
"""

import mmap
import struct
from collections import defaultdict
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from mcap.writer import MCAP0_MAGIC

from daq.errors import RecordingError

_RECORD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")
_CHANNEL_ID = struct.Struct("<H")
_MESSAGE_HEADER_SIZE = 22
_LAST_OPCODE = max(Opcode)


@dataclass(frozen=True, slots=True)
class Segment:
    """Bytes of the file, or of one of its chunks, and where the message records lie in them.

    ``offsets`` has for each channel id the offsets of its records' opcodes, in file order.
    """

    data: memoryview
    offsets: dict[int, list[int]]


@dataclass(slots=True)
class Scan:
    """What a file holds.

    Attributes
    ----------
    segments : in file order
    channels, schemas : by id
    complete_bytes : how far the file consists of whole records
    sealed : whether it ends with a footer
    """

    segments: list[Segment] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    complete_bytes: int = 0
    sealed: bool = False

    def channel_id(self, topic: str) -> int | None:
        """Return the id of a topic's channel, None where the file has none."""
        return next((key for key, channel in self.channels.items() if channel.topic == topic), None)

    def records(self, channel_id: int) -> list[memoryview]:
        """Return the message records of a channel, opcode and length included, in file order."""
        found: list[memoryview] = []
        for segment in self.segments:
            data = segment.data
            for offset in segment.offsets.get(channel_id, ()):
                length = _RECORD.unpack_from(data, offset)[1]
                found.append(data[offset : offset + _RECORD.size + length])
        return found

    def counts(self) -> dict[str, int]:
        """Return the number of messages of each topic."""
        return {
            channel.topic: sum(len(segment.offsets.get(key, ())) for segment in self.segments)
            for key, channel in self.channels.items()
        }


def scan(path: Path) -> Scan:
    """Scan a file; raises RecordingError where it is none of MCAP."""
    try:
        with path.open("rb") as file:
            start = file.read(len(MCAP0_MAGIC))
            if not MCAP0_MAGIC.startswith(start):
                raise RecordingError(f"{path}: is no MCAP file; it begins with {start!r}")
            if len(start) < len(MCAP0_MAGIC):
                return Scan()
            data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error})") from error
    result = Scan()
    result.complete_bytes = _scan_records(data, len(MCAP0_MAGIC), result)
    return result


def _scan_records(data: memoryview, position: int, result: Scan) -> int:
    """Collect all whole records from ``position`` on and return where the last of them ends."""
    offsets: defaultdict[int, list[int]] = defaultdict(list)
    result.segments.append(Segment(data, offsets))
    while position + _RECORD.size <= len(data):
        opcode, length = _RECORD.unpack_from(data, position)
        start = position + _RECORD.size
        if not 0 < opcode <= _LAST_OPCODE or start + length > len(data):
            break
        if opcode == Opcode.MESSAGE:
            if length < _MESSAGE_HEADER_SIZE:
                break
            offsets[_CHANNEL_ID.unpack_from(data, start)[0]].append(position)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.CHUNK):
            _scan_described(opcode, data[start : start + length], result)
        position = start + length
        if opcode == Opcode.FOOTER:
            result.sealed = True
            break
    return position


def _scan_described(opcode: int, body: memoryview, result: Scan) -> None:
    if opcode == Opcode.CHUNK:
        _scan_records(_chunk_records(body), 0, result)
        return
    stream = ReadDataStream(BytesIO(body))
    if opcode == Opcode.SCHEMA:
        schema = Schema.read(stream)
        result.schemas[schema.id] = schema
    else:
        channel = Channel.read(stream)
        result.channels[channel.id] = channel


def _chunk_records(body: memoryview) -> memoryview:
    """Return the records of a chunk; those of an uncompressed one are not copied."""
    *_, name_length = _CHUNK.unpack_from(body)
    name_end = _CHUNK.size + name_length
    compression = bytes(body[_CHUNK.size : name_end]).decode()
    data = body[name_end + 8 :]
    if compression == "zstd":
        return memoryview(zstandard.decompress(data))
    if compression:
        raise RecordingError(f"a chunk is compressed by {compression!r}; recordings use zstd or nothing")
    return data
