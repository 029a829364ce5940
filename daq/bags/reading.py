"""A bag as a source of tables for an import: one table a stream, each with its time and with both stamps.

Times count from the first message of the bag, in seconds; a number of seconds below a hundred days holds nanoseconds
exactly. The unix time of that instant stands beside each table.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from daq.bags.bag import Bag, open_bag
from daq.bags.clocks import stream_times
from daq.bags.decoding import Decode, UnknownTypeError, decoded, decoder_of, require_library
from daq.bags.fields import series_of_fields, series_of_joints
from daq.bags.pictures import INFO, KINDS, camera_line, image_line
from daq.bags.points import UntrackedError, series_of_points
from daq.bags.series import NO_STAMP, Series, Stamped
from daq.bags.storage import Messages, Topic
from daq.bags.transforms import Link, links_of, series_of_links
from daq.errors import RecordingError
from daq.recording.folder import INFO_FILE
from daq.recording.foreign_bags import METADATA_FILE
from estimator.importing.points import is_on_gripper
from estimator.importing.table import Column, Source, Table, require_tables
from robot_drivers.protocols import FloatArray, IntArray

_MOST_TOLD = 8
_TRANSFORMS = ("tf2_msgs/msg/TFMessage", "geometry_msgs/msg/TransformStamped", "tf/msg/tfMessage")
_POINTS = (
    "sensor_msgs/msg/PointCloud2",
    "sensor_msgs/msg/PointCloud",
    "visualization_msgs/msg/MarkerArray",
    "visualization_msgs/msg/Marker",
    "geometry_msgs/msg/PoseArray",
)
_JOINTS = "sensor_msgs/msg/JointState"


def read_bag(path: Path) -> Source:
    """Read the streams of a bag.

    Raises
    ------
    RecordingError
        It is no bag, holds no message, none of a stream of numbers, or the library for messages is missing.
    InputError
        There is no such file.
    """
    if path.name == METADATA_FILE:
        path = path.parent
    if (path / INFO_FILE).is_file():
        raise RecordingError(
            f"{path}: is a session of this software; `retract export` makes an experiment of it"
        )
    require_library(path)
    with open_bag(path) as bag:
        streams = _Streams()
        for topic in bag.topics:
            streams.take(topic, bag.read(topic))
        remarks = [*bag.all_faults(streams.read), *streams.remarks]
        series = streams.series()
        if not any(streams.read.values()):
            raise RecordingError(f"{path}: holds no message{_because(remarks)}; name another recording")
        if not series:
            topics = ", ".join(f"{one.name} ({one.type_name})" for one in bag.topics[:_MOST_TOLD])
            raise RecordingError(
                f"{path}: no topic is a stream of forces, poses, joints or points: {topics}{_because(remarks)}"
            )
    origin_ns = min(int(one.log_time_ns.min()) for one in series)
    found = [_table(one, origin_ns, remarks) for one in sorted(series, key=_first_on_the_gripper)]
    tables = require_tables(path, found, "is read as a bag")
    return Source(path, tables, _how(bag), remarks=tuple(remarks))


class _Streams:
    """Gathers the streams of a bag, topic by topic, and what cannot be one."""

    def __init__(self) -> None:
        self.remarks: list[str] = []
        self.read: dict[str, int] = {}
        self._series: list[Series] = []
        self._links: list[Link] = []

    def take(self, topic: Topic, messages: Messages) -> None:
        """Take the messages of a topic."""
        self.read[topic.name] = self.read.get(topic.name, 0) + len(messages.data)
        if not messages.data:
            return
        try:
            decode = decoder_of(topic)
            self._take(topic, messages, decode)
        except (UnknownTypeError, UntrackedError) as error:
            self.remarks.append(f"{topic.name}: {error}; left out")

    def series(self) -> list[Series]:
        """Return the streams of two rows or more, each under a name of its own."""
        found = [
            one for one in (*self._series, *series_of_links(self._links)) if one.rows > 1 and one.columns
        ]
        names = Counter(one.name for one in found)
        # topics of one name, and of several types or definitions
        return [
            replace(one, name=f"{one.name} ({place})") if names[one.name] > 1 else one
            for place, one in enumerate(found, start=1)
        ]

    def _take(self, topic: Topic, messages: Messages, decode: Decode) -> None:
        kind = _kind(topic)
        if kind in KINDS or kind == INFO:
            first = next((message for _, message in decoded(decode, messages.data)), None)
            if first is not None:
                line = camera_line(topic.name, first) if kind == INFO else ""
                self.remarks.append(line or image_line(topic.name, messages.log_time_ns, first))
            return
        count = 0

        def stamped() -> Stamped:
            nonlocal count
            for place, message in decoded(decode, messages.data):
                count += 1
                yield int(messages.log_time_ns[place]), message

        if kind in _TRANSFORMS:
            self._links += links_of(stamped())
        else:
            self._series += _maker_of(kind)(topic.name, stamped())
        if count < len(messages.data):
            lost = len(messages.data) - count
            self.remarks.append(
                f"{topic.name}: {lost} of {len(messages.data)} messages cannot be decoded; left out"
            )


def _maker_of(kind: str) -> Callable[[str, Stamped], list[Series]]:
    if kind in _POINTS:
        return series_of_points
    return series_of_joints if kind == _JOINTS else series_of_fields


def _kind(topic: Topic) -> str:
    """Return the type of a topic's messages as ROS 2 spells it."""
    package, _, name = topic.type_name.partition("/")
    return f"{package}/msg/{name}" if "/" not in name else topic.type_name


def _table(series: Series, origin_ns: int, remarks: list[str]) -> Table:
    """Return a stream with ascending times; of messages of one and the same time the first."""
    times = stream_times(series)
    order = np.argsort(times.time_ns, kind="stable")
    later = np.diff(times.time_ns[order], prepend=times.time_ns[order[0]] - 1) > 0
    kept = order[later]
    if len(kept) < series.rows:
        count = series.rows - len(kept)
        remarks.append(f"{series.name}: {count} of {series.rows} messages have the time of another; left out")
    columns = [Column("time", _seconds(times.time_ns[kept], origin_ns), "s")]
    if not np.any(series.header_time_ns == NO_STAMP):
        columns.append(Column("header stamp", _seconds(series.header_time_ns[kept], origin_ns), "s"))
    columns.append(Column("log time", _seconds(series.log_time_ns[kept], origin_ns), "s"))
    columns += [Column(name, values[kept], unit) for name, unit, values in series.columns]
    facts = {
        "type": series.type_name,
        "frame": series.frame,
        "time": times.how,
        "time 0": f"{origin_ns // 10**9}.{origin_ns % 10**9:09d} s of unix time",
        **series.facts,
    }
    return Table(series.name, tuple(columns), facts=facts)


def _seconds(time_ns: IntArray, origin_ns: int) -> FloatArray:
    return np.asarray((time_ns - origin_ns) / 1e9, dtype=np.float64)


def _first_on_the_gripper(series: Series) -> bool:
    """Sort streams whose name speaks of a tool to the front: of several poses, the first is proposed."""
    return not is_on_gripper(series.name)


def _how(bag: Bag) -> str:
    return f"{bag.how}, with messages of ROS"


def _because(remarks: Sequence[str]) -> str:
    return f" ({'; '.join(remarks[:3])})" if remarks else ""
