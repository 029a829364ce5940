"""Points in space that columns of coordinates belong to: markers, beads, subsets of an image."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.importing.roles import role_of
from estimator.importing.table import Column, FloatArray, Source, Table

_GRIPPER_WORDS = (
    "tip",
    "grip",
    "tool",
    "tcp",
    "plate",
    "platen",
    "jaw",
    "clamp",
    "forceps",
    "effector",
    "indent",
)


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """A point's name, its table, and its columns along x, y and z, None where one was not measured."""

    name: str
    table: Table
    columns: tuple[Column | None, Column | None, Column | None]
    unit: str | None

    @property
    def start(self) -> FloatArray:
        """Where it is first seen along each axis, NaN where it never is, (3,), in its unit."""
        return np.array([_first(column) for column in self.columns])

    @property
    def on_gripper(self) -> bool:
        """Whether its name says that it is on the gripper."""
        return is_on_gripper(self.name)


def is_on_gripper(name: str) -> bool:
    """Tell whether a name says that what it names is on the gripper."""
    return any(word in name.lower() for word in _GRIPPER_WORDS)


def points_of(source: Source) -> list[Point]:
    """Return the points that have at least two coordinates, in the order of the file."""
    found: list[Point] = []
    for table in source.tables:
        groups: dict[str, dict[str, tuple[Column, str | None]]] = {}
        for column in table.columns:
            role = role_of(column)
            if role.kind == "point":
                groups.setdefault(role.point, {}).setdefault(role.axis, (column, role.unit))
        for name, axes in groups.items():
            if len(axes) < 2:
                continue
            x, y, z = (axes[axis][0] if axis in axes else None for axis in "xyz")
            unit = next((unit for _, unit in axes.values() if unit), None)
            found.append(Point(name, table, (x, y, z), unit))
    return found


def spread(points: Sequence[Point], most: int) -> list[Point]:
    """Return at most so many points, as far from each other as can be: each next one is farthest from those before.

    Points that are not seen in the first tenth of the rows are left out.
    """
    seen = [point for point in points if np.isfinite(point.start).sum() >= 2]
    if len(seen) <= most:
        return seen
    places = np.nan_to_num(np.array([point.start for point in seen]))
    centre = places.mean(axis=0)
    chosen = [int(np.argmax(np.linalg.norm(places - centre, axis=1)))]
    away = np.linalg.norm(places - places[chosen[0]], axis=1)
    while len(chosen) < most:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return [seen[place] for place in sorted(chosen)]


def _first(column: Column | None) -> float:
    if column is None:
        return float("nan")
    known = column.values[: max(len(column.values) // 10, 1)]
    known = known[np.isfinite(known)]
    return float(known[0]) if len(known) else float("nan")
