"""Sealing: an unsealed MCAP file becomes one with chunks, index, statistics and footer that every tool reads.

The same code seals after a session and recovers after a crash: it keeps every whole message, and the original stays
until the sealed copy has been read back and holds the same number of messages on every topic.
"""

import os
import struct
from dataclasses import dataclass
from pathlib import Path

from mcap.writer import CompressionType, Writer

from daq.errors import RecordingError
from daq.recording.scan import Scan, scan

_MESSAGE = struct.Struct("<BQHIQQ")


@dataclass(frozen=True, slots=True)
class ChunkPolicy:
    """How the messages of a sealed file are grouped; ``chunk_bytes = 1`` gives every message its own chunk."""

    chunk_bytes: int
    compression: CompressionType


SIGNALS = ChunkPolicy(2**20, CompressionType.ZSTD)
IMAGES = ChunkPolicy(1, CompressionType.NONE)


@dataclass(frozen=True, slots=True)
class SealReport:
    """What sealing kept: messages by topic, and the bytes of an incomplete record at the end that it left out."""

    counts: dict[str, int]
    dropped_bytes: int


def seal(path: Path, policy: ChunkPolicy) -> SealReport:
    """Seal a file in place; a sealed one is left as it is.

    Raises
    ------
    RecordingError
        The copy does not hold what the original holds; the original is untouched.
    """
    original = scan(path)
    counts = original.counts()
    if original.sealed:
        return SealReport(counts, 0)
    copy = path.with_suffix(".sealing")
    with copy.open("wb") as file:
        writer = Writer(file, chunk_size=policy.chunk_bytes, compression=policy.compression)
        writer.start(profile="ros2")
        _copy_messages(original, writer)
        writer.finish()  # type: ignore[no-untyped-call] # the library leaves it untyped
        file.flush()
        os.fsync(file.fileno())
    sealed = scan(copy)
    if not sealed.sealed or sealed.counts() != counts:
        raise RecordingError(
            f"{copy}: holds {sealed.counts()} messages where {path.name} holds {counts}; the original is kept, "
            "look for a full or failing disk and run `retract recover` again"
        )
    dropped = path.stat().st_size - original.complete_bytes
    copy.replace(path)
    return SealReport(counts, dropped)


def _copy_messages(original: Scan, writer: Writer) -> None:
    schemas = {
        key: writer.register_schema(schema.name, schema.encoding, schema.data)
        for key, schema in original.schemas.items()
    }
    channels = {
        key: writer.register_channel(
            channel.topic, channel.message_encoding, schemas[channel.schema_id], channel.metadata
        )
        for key, channel in original.channels.items()
    }
    for segment in original.segments:
        for offset in sorted(offset for offsets in segment.offsets.values() for offset in offsets):
            _, length, channel_id, sequence, log_time, publish_time = _MESSAGE.unpack_from(
                segment.data, offset
            )
            writer.add_message(
                channel_id=channels[channel_id],
                log_time=log_time,
                data=bytes(segment.data[offset + _MESSAGE.size : offset + 9 + length]),
                publish_time=publish_time,
                sequence=sequence,
            )
