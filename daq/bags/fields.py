"""The numbers of a message as columns: forces in N, places in m, orientations as quaternions, any other by its path."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from daq.bags.series import Series, Stamped, Stamps
from robot_drivers.protocols import FloatArray

_MOST_OF_AN_ARRAY = 12
_BESIDE = ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_KNOWN: dict[tuple[str, str], tuple[str, str | None]] = {
    ("geometry_msgs/msg/Wrench", "force"): ("force", "N"),
    ("geometry_msgs/msg/Wrench", "torque"): ("torque", "N·m"),
    ("geometry_msgs/msg/Pose", "position"): ("position", "m"),
    ("geometry_msgs/msg/Pose", "orientation"): ("q", None),
    ("geometry_msgs/msg/Transform", "translation"): ("position", "m"),
    ("geometry_msgs/msg/Transform", "rotation"): ("q", None),
}
"""Fields of a message whose quantity is fixed: what their columns are called, and their unit."""
_PLACES = ("geometry_msgs/msg/Point", "geometry_msgs/msg/Point32")
_DIRECTIONS = ("geometry_msgs/msg/Vector3",)

_Leaf = tuple[str, str, str | None]


def series_of_fields(topic: str, messages: Stamped) -> list[Series]:
    """Return the numbers that every message of a topic has at the same places, as one stream.

    A vector whose quantity the type does not tell has the columns ``.0`` to ``.2``: it is no point in space.
    """
    stamps = Stamps()
    leaves: list[_Leaf] = []
    rows: list[Any] = []
    type_name = ""
    for message in stamps.through(messages):
        if not rows:
            type_name = str(getattr(message, "__msgtype__", ""))
            leaves = list(_leaves(message))
            # the class beside them, so that one path alone gives a tuple too
            get = attrgetter(*(path for path, _, _ in leaves), "__class__") if leaves else None
        rows.append(get(message) if get is not None else ())
    columns: list[tuple[str, str | None, FloatArray]] = []
    for place, (_, name, unit) in enumerate(leaves):
        columns += _columns(name, unit, [row[place] for row in rows])
    made = _continuous(columns)
    return [Series(topic, type_name, stamps.log_time_ns, stamps.header_time_ns, tuple(made), stamps.frame)]


def series_of_joints(topic: str, messages: Stamped) -> list[Series]:
    """Return angle, speed and effort of each joint that the first message names, NaN in messages without it."""
    stamps = Stamps()
    names: list[str] = []
    rows: list[dict[str, tuple[float, ...]]] = []
    for message in stamps.through(messages):
        names = names or [str(name) for name in message.name]
        parts = (message.position, message.velocity, message.effort)
        rows.append(
            {
                str(name): tuple(float(part[place]) if place < len(part) else np.nan for part in parts)
                for place, name in enumerate(message.name)
            }
        )
    unknown = (np.nan, np.nan, np.nan)
    columns: list[tuple[str, str | None, FloatArray]] = []
    for name in names:
        values = np.array([row.get(name, unknown) for row in rows], np.float64).reshape(-1, 3)
        for place, (what, unit) in enumerate((("angle", "rad"), ("speed", "rad/s"), ("effort", "N·m"))):
            if np.isfinite(values[:, place]).any():
                columns.append((f"joint {name} {what}", unit, values[:, place]))
    return [
        Series(
            topic,
            "sensor_msgs/msg/JointState",
            stamps.log_time_ns,
            stamps.header_time_ns,
            tuple(columns),
            stamps.frame,
        )
    ]


def _leaves(message: Any, path: str = "", name: str = "", unit: str | None = None) -> Iterator[_Leaf]:
    """Yield path, column and unit of each number in a message."""
    owner = str(getattr(message, "__msgtype__", ""))
    for one in fields(message):
        value = getattr(message, one.name)
        inner = f"{path}{one.name}"
        kind = str(getattr(value, "__msgtype__", ""))
        if kind in _BESIDE or one.name.startswith("__"):
            continue
        known = _KNOWN.get((owner, one.name))
        called = _called(name, known[0] if known else one.name, owner, known=unit is not None)
        if is_dataclass(value):
            inner_unit = known[1] or "1" if known else "m" if kind in _PLACES else None
            yield from _leaves(value, f"{inner}.", f"{called}.", inner_unit)
        elif isinstance(value, (bool, int, float, np.number)):
            yield inner, called, None if unit == "1" else unit
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.size <= _MOST_OF_AN_ARRAY:
            yield inner, called, None


def _called(prefix: str, name: str, owner: str, *, known: bool) -> str:
    """Return the name of a column; components of a vector of unknown quantity are numbered."""
    if owner in _DIRECTIONS and not known:
        return f"{prefix}{'xyz'.index(name)}"
    return f"{prefix}{name}"


def _columns(name: str, unit: str | None, values: list[Any]) -> Iterator[tuple[str, str | None, FloatArray]]:
    if not isinstance(values[0], np.ndarray):
        yield name, unit, np.array(values, np.float64)
        return
    size = len(values[0])
    if any(len(one) != size for one in values):
        return
    together = np.array(values, np.float64).reshape(len(values), size)
    for place in range(size):
        yield f"{name}.{place}", unit, together[:, place]


def _continuous(
    columns: list[tuple[str, str | None, FloatArray]],
) -> list[tuple[str, str | None, FloatArray]]:
    """Turn the sign of quaternions over where it leaps: both signs are one rotation, and rows are read between."""
    by_name = {name: place for place, (name, _, _) in enumerate(columns)}
    made = list(columns)
    for name, place in by_name.items():
        parts = [by_name.get(f"{name[:-1]}{axis}") for axis in "wxyz"]
        if not name.endswith("q.w") or None in parts:
            continue
        values = continuous_quaternions(np.stack([columns[part or place][2] for part in parts], axis=1))
        for part, axis in zip(parts, range(4), strict=True):
            if part is not None:
                made[part] = (columns[part][0], columns[part][1], values[:, axis])
    return made


def continuous_quaternions(values: FloatArray) -> FloatArray:
    """Return quaternions (n, 4) each of which is nearer to the one before than its opposite is."""
    products = np.sum(values[1:] * values[:-1], axis=1)
    signs = np.cumprod(np.where(products < 0, -1.0, 1.0))
    return np.asarray(values * np.concatenate([[1.0], signs])[: len(values), None])
