"""The MCAP file while it is being recorded: append-only, no chunks, no index, no buffer.

Whatever :meth:`McapLog.append` has returned from is in the operating system's hands and survives the death of the
process; the disk follows within a second (:meth:`McapLog.sync`). Such a file has no footer. Sealing writes one.
"""

import os
from pathlib import Path
from types import TracebackType
from typing import Self

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Header, McapRecord
from mcap.records import Schema as SchemaRecord
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC

from daq.recording.schemas import Schema


class McapLog:
    """An MCAP file open for appending. Not thread-safe, but for :meth:`sync`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = path.open("xb", buffering=0)
        self._schemas: dict[str, int] = {}
        self._channels = 0
        self.append(MCAP0_MAGIC + _encoded(Header(profile="ros2", library=LIBRARY_IDENTIFIER)))

    def add_channel(self, topic: str, schema: Schema) -> int:
        """Declare a channel and return its id."""
        if schema.name not in self._schemas:
            self._schemas[schema.name] = len(self._schemas) + 1
            self.append(
                _encoded(
                    SchemaRecord(
                        id=self._schemas[schema.name],
                        name=schema.name,
                        encoding=schema.encoding,
                        data=schema.text.encode(),
                    )
                )
            )
        self._channels += 1
        channel = Channel(
            id=self._channels,
            topic=topic,
            message_encoding=schema.message_encoding,
            metadata={},
            schema_id=self._schemas[schema.name],
        )
        self.append(_encoded(channel))
        return self._channels

    def append(self, records: bytes) -> None:
        """Write complete records."""
        rest = memoryview(records)
        while rest:
            rest = rest[self._file.write(rest) :]

    def sync(self) -> None:
        """Wait until everything appended so far is on the disk; may be called from another thread."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Bring everything to the disk and close the file, unsealed."""
        if not self._file.closed:
            self.sync()
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _encoded(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()  # type: ignore[no-untyped-call] # the library leaves it untyped
