"""The MCAP file while it is being recorded: it grows by whole chunks, each in one write, without a buffer.

Whatever :meth:`McapLog.append` has returned from is in the operating system's hands and survives the death of the
process; the disk follows when :meth:`McapLog.sync` is called. Such a file has no summary. Sealing appends one.
"""

import os
import sys
from collections.abc import Mapping
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Header, McapRecord
from mcap.records import Schema as SchemaRecord
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC

from daq.recording.in_use import lock
from daq.recording.mcap.chunks import Rows, encode_chunk
from daq.recording.mcap.schemas import Schema
from robot_drivers.closing import ClosedAtExit

_NOTHING: Mapping[str, str] = {}


class McapLog(ClosedAtExit):
    """An MCAP file open for appending, locked as long as its process lives. Only :meth:`sync` is thread-safe."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = path.open("xb", buffering=0)
        lock(self._file)
        self._position = 0
        self._schemas: dict[str, int] = {}
        self._channels = 0
        self._write(preamble())

    def add_channel(self, topic: str, schema: Schema, metadata: Mapping[str, str] = _NOTHING) -> int:
        """Declare a channel, with what else is said of it, and return its id."""
        self._channels += 1
        channel = Channel(
            id=self._channels,
            topic=topic,
            message_encoding=schema.message_encoding,
            metadata=dict(metadata),
            schema_id=self._add_schema(schema) if schema.name else 0,
        )
        self._write(encoded(channel))
        return self._channels

    def append(self, *batch: Rows) -> None:
        """Write a chunk of at least one message.

        Raises
        ------
        OSError
            The disk does not take it; what it took of it is cut off again.
        """
        self._write(encode_chunk(batch, self._position)[0])

    def sync(self) -> None:
        """Wait until everything appended so far is on the disk; may be called from another thread."""
        if sys.platform == "linux":
            os.fdatasync(self._file.fileno())
        else:
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Bring everything to the disk and close the file, unsealed."""
        if not self._file.closed:
            try:
                self.sync()
            finally:
                self._file.close()

    def _add_schema(self, schema: Schema) -> int:
        """Declare a schema unless it is, and return its id."""
        if schema.name not in self._schemas:
            self._schemas[schema.name] = len(self._schemas) + 1
            record = SchemaRecord(
                id=self._schemas[schema.name],
                name=schema.name,
                encoding=schema.encoding,
                data=schema.text.encode(),
            )
            self._write(encoded(record))
        return self._schemas[schema.name]

    def _write(self, records: bytes) -> None:
        rest = memoryview(records)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            self._file.truncate(self._position)
            self._file.seek(self._position)
            raise
        self._position += len(records)


def preamble() -> bytes:
    """Return what a recording begins with."""
    return MCAP0_MAGIC + encoded(Header(profile="ros2", library=LIBRARY_IDENTIFIER))


def encoded(record: McapRecord) -> bytes:
    """Return the bytes of one record."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()  # type: ignore[no-untyped-call] # the library leaves it untyped
