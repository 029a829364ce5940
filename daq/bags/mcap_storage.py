"""MCAP files of other programs, read by the scan that reads a session's own: whatever is whole, whatever is damaged."""

from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from daq.bags.storage import Messages, Topic
from daq.recording.messages.rows import RECORD
from daq.recording.scanning.chunk_reading import UnusableError, chunk_head
from daq.recording.scanning.records import parse_declaration
from daq.recording.scanning.scan import scan_foreign
from daq.recording.scanning.segments import Damage, Scan, Segment
from daq.recording.scanning.walking import walk
from robot_drivers.closing import ClosedAtExit


class McapStorage(ClosedAtExit):
    """An MCAP file; raises RecordingError where it is none."""

    def __init__(self, file: Path) -> None:
        self._found = scan_foreign(file)
        _take_what_is_cut_off(self._found)
        counts = self._found.counts_by_channel()
        self._channels: dict[Topic, list[int]] = {}
        for key, channel in self._found.channels.items():
            if counts.get(key):
                self._channels.setdefault(self._topic(channel), []).append(key)

    @property
    def topics(self) -> tuple[Topic, ...]:
        """What is in the file."""
        return tuple(self._channels)

    @property
    def faults(self) -> tuple[str, ...]:
        """What is wrong with the file; a missing summary at its end says that it was cut off."""
        faults = self._found.faults
        if not faults and not self._found.sealed:
            return ("its end is missing; what was written is read",)
        return tuple(faults)

    def read(self, topic: Topic) -> Messages:
        """Return the messages of a topic, in the order of the file."""
        data: list[bytes | memoryview] = []
        times = [np.empty(0, np.int64)]
        for segment in self._found.segments:
            for key in self._channels[topic]:
                heads = segment.heads(key)
                if not len(heads):
                    continue
                times.append(heads["log_time"].astype(np.int64))
                starts = segment.offsets[key] + RECORD.itemsize
                ends = segment.offsets[key] + heads["length"].astype(np.int64) + _LENGTH_COUNTS_FROM
                places = zip(starts.tolist(), ends.tolist(), strict=True)
                data += [segment.data[start:end] for start, end in places]
        return Messages(np.concatenate(times), data)

    def close(self) -> None:
        """Close the file."""
        self._found.close()

    def _topic(self, channel: Channel) -> Topic:
        schema = self._found.schemas.get(channel.schema_id)
        if schema is None:
            return Topic(channel.topic, "", channel.message_encoding)
        text = schema.data.decode("utf-8", "replace")
        return Topic(channel.topic, schema.name, channel.message_encoding, schema.encoding, text)


_LENGTH_COUNTS_FROM = 9


def _take_what_is_cut_off(found: Scan) -> None:
    """Take the whole messages of an uncompressed chunk that the end of the file cuts off, and the channels within it.

    A session's own are told from damage by their numbers; other programs write 0 for each.
    """
    if not found.damages or not found.damages[-1].size or found.damages[-1].end != len(found.view):
        return
    last = found.damages[-1]
    if found.view[last.start] != Opcode.CHUNK:
        return
    try:
        head = chunk_head(found.view, last.start)
    except UnusableError:
        return
    if head.compression or head.records_start + head.sizes[0] <= len(found.view):
        return
    records = found.view[head.records_start :]
    walked = walk(records)
    for opcode, body in walked.others:
        declared = parse_declaration(opcode, body) if opcode in (Opcode.SCHEMA, Opcode.CHANNEL) else None
        if isinstance(declared, Schema):
            found.schemas.setdefault(declared.id, declared)
        elif isinstance(declared, Channel):
            found.channels.setdefault(declared.id, declared)
    if walked.offsets:
        end = head.records_start + walked.end
        kept = Segment(
            records[: walked.end], walked.offsets, walked.log_times, None, last.start, end, checked=False
        )
        found.segments.append(kept)
        count = sum(map(len, walked.offsets.values()))
        what = f"{last.what}; {count} whole messages of it are kept, without a checksum"
        found.damages[-1] = Damage(end, last.end - end, what, last.missing)
