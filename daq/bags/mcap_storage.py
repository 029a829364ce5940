"""MCAP files of other programs, read by the scan that reads a session's own: whatever is whole, whatever is damaged."""

from pathlib import Path

import numpy as np
from mcap.records import Channel

from daq.bags.storage import Messages, Topic
from daq.recording.messages.rows import RECORD
from daq.recording.scanning.scan import scan_foreign
from robot_drivers.closing import ClosedAtExit


class McapStorage(ClosedAtExit):
    """An MCAP file; raises RecordingError where it is none."""

    def __init__(self, file: Path) -> None:
        self._found = scan_foreign(file)
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
