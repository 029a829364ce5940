"""SQLite3 files of a rosbag2, as ``rosbag2_storage_sqlite3`` writes them: tables ``topics`` and ``messages``.

Definitions of the types stand in ``message_definitions`` since ROS 2 Iron; a bag of an earlier release has none.
"""

import sqlite3
from pathlib import Path

import numpy as np

from daq.bags.storage import Messages, Topic
from daq.errors import RecordingError
from robot_drivers.closing import ClosedAtExit

MAGIC = b"SQLite format 3\x00"


class SqliteStorage(ClosedAtExit):
    """A SQLite3 file.

    Raises
    ------
    RecordingError
        It cannot be read, or is no part of a rosbag2.
    """

    def __init__(self, file: Path) -> None:
        self._faults: list[str] = []
        try:
            self._store = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro", uri=True)
            self._store.text_factory = lambda text: text.decode("utf-8", "replace")
        except sqlite3.Error as error:
            raise RecordingError(f"{file}: cannot be read as SQLite3 ({error}); is it a rosbag2?") from None
        try:
            rows = self._store.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
            self._topics = {self._topic(*row[1:]): int(row[0]) for row in rows}
        except (sqlite3.Error, TypeError, ValueError) as error:
            self._store.close()
            raise RecordingError(
                f"{file}: holds no topics of a rosbag2 ({error}); restore it from a copy, or name another file"
            ) from None

    @property
    def topics(self) -> tuple[Topic, ...]:
        """What is in the file."""
        return tuple(self._topics)

    @property
    def faults(self) -> tuple[str, ...]:
        """What is wrong with the file."""
        return tuple(self._faults)

    def read(self, topic: Topic) -> Messages:
        """Return the messages of a topic in the order of their times, up to the first that cannot be read."""
        times: list[int] = []
        data: list[bytes | memoryview] = []
        try:
            asked = "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY timestamp, id"
            for time_ns, body in self._store.execute(asked, (self._topics[topic],)):
                if isinstance(time_ns, int) and isinstance(body, bytes):
                    times.append(time_ns)
                    data.append(body)
        except sqlite3.Error as error:
            self._faults.append(f"{topic.name}: is read up to message {len(times)} ({error})")
        return Messages(np.array(times, np.int64), data)

    def close(self) -> None:
        """Close the file."""
        self._store.close()

    def _topic(self, name: str, type_name: str, encoding: str) -> Topic:
        try:
            found = self._store.execute(
                "SELECT encoding, encoded_message_definition FROM message_definitions WHERE topic_type = ?",
                (type_name,),
            ).fetchone()
        except sqlite3.Error:
            found = None
        if not found or not found[1]:
            return Topic(name, type_name, encoding)
        return Topic(name, type_name, encoding, str(found[0]), str(found[1]))
