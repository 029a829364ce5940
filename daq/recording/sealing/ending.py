"""The end of an MCAP file as it is written: what closes the data, the summary, the footer."""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Footer, McapRecord, Schema, Statistics, SummaryOffset
from mcap.writer import MCAP0_MAGIC

from daq.recording.mcap.log import encoded
from daq.recording.scanning.segments import Scan

_FOOTER_WITHOUT_CRC = 25


@dataclass(frozen=True, slots=True)
class Ending:
    """What a summary tells of a file.

    Attributes
    ----------
    messages : by channel id
    attachments, metadata : how many
    """

    schemas: Sequence[Schema]
    channels: Sequence[Channel]
    messages: Mapping[int, int]
    chunks: Sequence[ChunkIndex]
    attachments: int
    metadata: int

    def written(self, position: int) -> bytes:
        """Return everything behind the messages, which end at ``position``."""
        end = encoded(DataEnd(data_section_crc=0))
        return end + _summary(self, position + len(end))


def ending_of(found: Scan) -> Ending:
    """Return what a summary tells of what was found."""
    attachments = sum(record[0] == Opcode.ATTACHMENT for record in found.beside)
    return Ending(
        list(found.schemas.values()),
        list(found.channels.values()),
        found.counts_by_channel(),
        [segment.index for segment in found.segments if segment.index is not None],
        attachments,
        len(found.beside) - attachments,
    )


def all_encoded(records: Sequence[McapRecord]) -> bytes:
    """Return the bytes of records end to end."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()  # type: ignore[no-untyped-call] # the library leaves it untyped


def _summary(ending: Ending, position: int) -> bytes:
    """Return everything behind the data section, which ends at ``position``."""
    chunks = ending.chunks
    statistics = Statistics(
        attachment_count=ending.attachments,
        channel_count=len(ending.channels),
        channel_message_counts={key: count for key, count in ending.messages.items() if count},
        chunk_count=len(chunks),
        message_count=sum(ending.messages.values()),
        message_end_time=max((chunk.message_end_time for chunk in chunks), default=0),
        message_start_time=min((chunk.message_start_time for chunk in chunks), default=0),
        metadata_count=ending.metadata,
        schema_count=len(ending.schemas),
    )
    groups: dict[Opcode, Sequence[McapRecord]] = {
        Opcode.SCHEMA: ending.schemas,
        Opcode.CHANNEL: ending.channels,
        Opcode.STATISTICS: [statistics],
        Opcode.CHUNK_INDEX: chunks,
    }
    summary = b""
    offsets = []
    for opcode, records in groups.items():
        group = all_encoded(records)
        if group:
            offsets.append(
                SummaryOffset(
                    group_opcode=opcode, group_start=position + len(summary), group_length=len(group)
                )
            )
        summary += group
    offsets_start = position + len(summary)
    summary += all_encoded(offsets)
    footer = encoded(Footer(summary_start=position, summary_offset_start=offsets_start, summary_crc=0))
    crc = zlib.crc32(summary + footer[:_FOOTER_WITHOUT_CRC])
    return summary + footer[:_FOOTER_WITHOUT_CRC] + crc.to_bytes(4, "little") + MCAP0_MAGIC
