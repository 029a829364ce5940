"""The end of an MCAP file: its footer, and the summary before it, believed where its checksum agrees.

MCAP specification, "Footer (op=0x02)": a checksum of zero means that there is none.
"""

import struct
from dataclasses import dataclass, field, replace
from io import BytesIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC
from zlib_ng import zlib_ng

from daq.recording.scanning.segments import RECORD

_FOOTER = struct.Struct("<QQI")
_FOOTER_SIZE = RECORD.size + _FOOTER.size
_DATA_END_SIZE = RECORD.size + 4


@dataclass(frozen=True, slots=True)
class Summary:
    """What the end of a file tells.

    Attributes
    ----------
    data_end : where the record lies that ends the data; None where that cannot be told
    begin : where the summary begins; None where its checksum does not agree
    fault : why the summary is not believed; empty for a good one
    checked : whether its checksum agrees; False where it has none
    counts : messages by channel id; None where it does not tell
    chunks : time of the first message of each chunk by its place
    """

    data_end: int | None = None
    begin: int | None = None
    fault: str = ""
    checked: bool = False
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    counts: dict[int, int] | None = None
    chunks: dict[int, int] = field(default_factory=dict)


def read_summary(data: memoryview) -> Summary | None:
    """Read the end of a file; None where nothing there says that there is a summary."""
    footer = len(data) - len(MCAP0_MAGIC) - _FOOTER_SIZE
    ends_as_mcap = data[len(data) - len(MCAP0_MAGIC) :] == MCAP0_MAGIC
    is_footer = footer >= 0 and RECORD.unpack_from(data, footer) == (Opcode.FOOTER, _FOOTER.size)
    if not is_footer or not ends_as_mcap:
        told = "the footer is damaged" if ends_as_mcap or is_footer else ""
        return Summary(fault=told) if told and footer >= 0 else None
    begin, _, checksum = _FOOTER.unpack_from(data, footer + RECORD.size)
    if not begin:  # a file without a summary, complete all the same
        return Summary(data_end=_data_end(data, footer))
    if begin > footer:
        return Summary(fault="the footer is damaged")
    checked_until = footer + _FOOTER_SIZE - struct.calcsize("<I")
    if checksum and zlib_ng.crc32(data[begin:checked_until]) != checksum:
        return Summary(fault="CRC of the summary disagrees", data_end=_data_end(data, begin))
    try:
        return replace(_read(data[begin:footer], _data_end(data, begin), checked=checksum != 0), begin=begin)
    except (McapError, ValueError, struct.error):
        return Summary(fault="the summary is damaged", data_end=_data_end(data, begin))


def _read(records: memoryview, data_end: int | None, *, checked: bool) -> Summary:
    fault = "" if data_end is not None else "the record that ends the data is damaged"
    found = Summary(data_end, fault=fault, checked=checked)
    counts = None
    place = 0
    while place < len(records):
        opcode, length = RECORD.unpack_from(records, place)
        body = records[place + RECORD.size : place + RECORD.size + length]
        if len(body) != length:
            raise ValueError("a record of the summary is cut off")
        stream = ReadDataStream(BytesIO(body))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            found.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(stream)
            found.channels[channel.id] = channel
        elif opcode == Opcode.STATISTICS:
            counts = dict(Statistics.read(stream).channel_message_counts)
        elif opcode == Opcode.CHUNK_INDEX:
            index = ChunkIndex.read(stream)
            found.chunks[index.chunk_start_offset] = index.message_start_time
        place += RECORD.size + length
    return replace(found, counts=counts)


def _data_end(data: memoryview, behind: int) -> int | None:
    """Return where the record that ends the data begins, given the first byte behind it."""
    start = behind - _DATA_END_SIZE
    is_there = start >= 0 and RECORD.unpack_from(data, start) == (Opcode.DATA_END, 4)
    return start if is_there else None
