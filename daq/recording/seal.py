"""Sealing: an unsealed MCAP file gets the index, statistics and footer that every tool reads.

The same code seals after a session and recovers after a crash. Nothing is copied and no message is touched: what is
left of a chunk that was cut off is put into a chunk of its own, and the summary is appended. That takes megabytes, so
a full disk is rarely too full for it, and a second attempt begins where the first did.
"""

import os
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Footer, McapRecord, Schema, Statistics, SummaryOffset
from mcap.writer import MCAP0_MAGIC

from daq.errors import RecordingError
from daq.recording.chunks import encode_chunk
from daq.recording.mcap_log import encoded, preamble
from daq.recording.scan import scan

_FOOTER_WITHOUT_CRC = 25
# of what is behind the last whole chunk, to be put back where sealing fails: many times what a recorder writes at once
_MOST_KEPT_BYTES = 256_000_000


@dataclass(frozen=True, slots=True)
class SealReport:
    """What sealing kept: messages by topic, and the bytes of an incomplete record at the end that it left out."""

    counts: dict[str, int]
    dropped_bytes: int


def seal(path: Path) -> SealReport:
    """Seal a file in place; a sealed one is left as it is.

    Raises
    ------
    RecordingError
        The sealed file does not hold what the unsealed one held, and is as it was; look for a failing disk.
    """
    with scan(path) as found:
        counts = found.counts()
        if found.sealed:
            return SealReport(counts, 0)
        chunks = [segment.index for segment in found.segments if segment.index is not None]
        remains = [segment.rows() for segment in found.segments if segment.index is None]
        channels, schemas = list(found.channels.values()), list(found.schemas.values())
        messages = {
            key: sum(len(segment.offsets.get(key, ())) for segment in found.segments)
            for key in found.channels
        }
        complete_bytes, lost_bytes = found.complete_bytes, found.lost_bytes
    # from here on the file is not mapped into memory any more: no system may cut a mapped file
    begun = complete_bytes >= len(preamble())
    start = complete_bytes if begun else 0
    with path.open("r+b") as file:
        file.seek(start)
        replaced = file.read(_MOST_KEPT_BYTES)
        position = file.seek(start)
        file.truncate()
        if not begun:
            position += file.write(preamble())
        for rows in remains:
            records, index = encode_chunk([rows], position)
            chunks.append(index)
            position += file.write(records)
        position += file.write(encoded(DataEnd(data_section_crc=0)))
        file.write(_summary(schemas, channels, chunks, messages, position))
        file.flush()
        os.fsync(file.fileno())
    try:
        with scan(path) as sealed:
            if not sealed.sealed or _present(sealed.counts()) != _present(counts):
                raise RecordingError(
                    f"{path}: holds {sealed.counts()} messages after sealing and {counts} before; look for a failing "
                    "disk and run `retract recover` again"
                )
    except RecordingError:
        with path.open("r+b") as file:
            file.seek(start)
            file.write(replaced)
            file.truncate()
        raise
    return SealReport(counts, lost_bytes)


def _present(counts: Mapping[str, int]) -> dict[str, int]:
    """Leave out topics without a message: one declared within a record that was cut off is not declared any more."""
    return {topic: count for topic, count in counts.items() if count}


def _summary(
    schemas: Sequence[Schema],
    channels: Sequence[Channel],
    chunks: Sequence[ChunkIndex],
    messages: dict[int, int],
    position: int,
) -> bytes:
    """Return everything behind the data section, which ends at ``position``."""
    statistics = Statistics(
        attachment_count=0,
        channel_count=len(channels),
        channel_message_counts={key: count for key, count in messages.items() if count},
        chunk_count=len(chunks),
        message_count=sum(messages.values()),
        message_end_time=max((chunk.message_end_time for chunk in chunks), default=0),
        message_start_time=min((chunk.message_start_time for chunk in chunks), default=0),
        metadata_count=0,
        schema_count=len(schemas),
    )
    groups: dict[Opcode, Sequence[McapRecord]] = {
        Opcode.SCHEMA: schemas,
        Opcode.CHANNEL: channels,
        Opcode.STATISTICS: [statistics],
        Opcode.CHUNK_INDEX: chunks,
    }
    summary = b""
    offsets = []
    for opcode, records in groups.items():
        group = _all_encoded(records)
        if group:
            offsets.append(
                SummaryOffset(
                    group_opcode=opcode, group_start=position + len(summary), group_length=len(group)
                )
            )
        summary += group
    offsets_start = position + len(summary)
    summary += _all_encoded(offsets)
    footer = encoded(Footer(summary_start=position, summary_offset_start=offsets_start, summary_crc=0))
    crc = zlib.crc32(summary + footer[:_FOOTER_WITHOUT_CRC])
    return summary + footer[:_FOOTER_WITHOUT_CRC] + crc.to_bytes(4, "little") + MCAP0_MAGIC


def _all_encoded(records: Sequence[McapRecord]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()  # type: ignore[no-untyped-call] # the library leaves it untyped
