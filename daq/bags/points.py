"""Messages that hold many points: each point that keeps its identity becomes one to be followed, as a bead is."""

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np

from daq.bags.series import Series, Stamped, Stamps
from robot_drivers.protocols import FloatArray

MOST_POINTS = 2000
_IDENTITIES = ("id", "label", "index", "track_id")
# PointField of sensor_msgs: the kinds of numbers
_KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}

Places = Mapping[Hashable, tuple[float, float, float]]


class UntrackedError(ValueError):
    """Points that cannot be told apart from message to message; the text says why."""


def series_of_points(topic: str, messages: Stamped) -> list[Series]:
    """Return the points of clouds, markers or arrays of poses, NaN where one is not in a message.

    Raises
    ------
    UntrackedError
        Their number changes and nothing names them, or there are too many for beads.
    """
    stamps = Stamps()
    rows: list[Places] = []
    keys: dict[Hashable, None] = {}
    type_name, counts, named = "", set(), True
    for message in stamps.through(messages):
        type_name = str(message.__msgtype__)
        places, named_here = places_of(message)
        named &= named_here
        counts.add(len(places))
        keys.update(dict.fromkeys(places))
        if len(keys) > MOST_POINTS:
            raise UntrackedError(f"has more than {MOST_POINTS} points: a surface, and no beads")
        rows.append(places)
    if not named and len(counts) > 1:
        raise UntrackedError(
            f"has {min(counts)} to {max(counts)} points without a field {_IDENTITIES[0]} that tells them apart"
        )
    nowhere = (np.nan, np.nan, np.nan)
    columns: list[tuple[str, str | None, FloatArray]] = []
    for key in keys:
        values = np.array([row.get(key, nowhere) for row in rows], np.float64).reshape(-1, 3)
        columns += [(f"bead {key}.{axis}", "m", values[:, place]) for place, axis in enumerate("xyz")]
    return [Series(topic, type_name, stamps.log_time_ns, stamps.header_time_ns, tuple(columns), stamps.frame)]


def places_of(message: Any) -> tuple[Places, bool]:
    """Return the points of a message by what tells them apart, m, and whether that is more than their order."""
    kind = str(message.__msgtype__).rpartition("/")[2]
    if kind == "PointCloud2":
        return _of_cloud(message)
    if kind == "MarkerArray":
        # an action of 2 or 3 takes markers away
        kept = [one for one in message.markers if int(one.action) == 0]
        return {f"{one.ns}/{one.id}" if one.ns else int(one.id): _place(one.pose) for one in kept}, True
    if kind == "Marker":
        return {place: _point(one) for place, one in enumerate(message.points)}, False
    if kind == "PoseArray":
        return {place: _place(one) for place, one in enumerate(message.poses)}, False
    return {place: _point(one) for place, one in enumerate(message.points)}, False


def _of_cloud(message: Any) -> tuple[Places, bool]:
    """Return the points of a cloud; raises UntrackedError where it has no x, y, z or states another size."""
    order = ">" if message.is_bigendian else "<"
    named = {
        str(one.name): (f"{order}{_KINDS[int(one.datatype)]}", int(one.offset))
        for one in message.fields
        if int(one.datatype) in _KINDS and int(one.count) in (0, 1)
    }
    if not all(axis in named for axis in "xyz"):
        raise UntrackedError("is a cloud without x, y and z")
    width, height, step = int(message.width), int(message.height), int(message.point_step)
    count = width * height
    if count > MOST_POINTS:
        raise UntrackedError(f"has {count} points a message: a surface, and no beads")
    record = np.dtype(
        {
            "names": list(named),
            "formats": [kind for kind, _ in named.values()],
            "offsets": [offset for _, offset in named.values()],
            "itemsize": step,
        }
    )
    data = np.ascontiguousarray(message.data, np.uint8)
    # a row may be padded
    rows = [
        data[row * int(message.row_step) : row * int(message.row_step) + width * step]
        for row in range(height)
    ]
    points = np.frombuffer(np.concatenate(rows).tobytes() if rows else b"", record)
    places = np.stack([points[axis].astype(np.float64) for axis in "xyz"], axis=1)
    identity = next((name for name in _IDENTITIES if name in named), None)
    keys = range(count) if identity is None else points[identity].astype(np.int64).tolist()
    found = {key: (x, y, z) for key, (x, y, z) in zip(keys, places.tolist(), strict=True)}
    return found, identity is not None


def _place(pose: Any) -> tuple[float, float, float]:
    return _point(pose.position)


def _point(point: Any) -> tuple[float, float, float]:
    return float(point.x), float(point.y), float(point.z)
