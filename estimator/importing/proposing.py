"""What the columns of a source may be in an experiment: as much as names, units and physics tell."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.importing.course import rows_at_rest
from estimator.importing.points import Point, points_of, spread
from estimator.importing.roles import QUANTITY_OF, Kind, Role, numbered_quaternion, role_of
from estimator.importing.table import Column, FloatArray, Source, Table
from estimator.importing.units import UNITS
from estimator.uniaxial.reading.language.units import spelt

MOST_BEADS = 30
_FEWEST_AT_REST = 8
_RIGHT_BEFORE = 5  # rows at rest that tell a force's zero
_LETTER: dict[Kind, str] = {"position": "p", "force": "f", "torque": "t", "turn": "r", "quaternion": "q"}


@dataclass(frozen=True, slots=True, eq=False)
class Proposed:
    """A column with the target that it may fill."""

    target: str
    table: Table
    column: Column
    name: str
    unit: str | None
    needs_unit: bool


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """What was understood of a source.

    Attributes
    ----------
    times : of each table that has one
    channels : by target; of several columns for one target the first is taken
    gripper : points that are fixed to the gripper, by their names
    beads : at most 30 of the others, evenly spread
    all_points : how many there are
    force_of : what the force is exerted by, where the work that it does tells
    force_frame : that the file states the force in, where that is another than the motion's; empty otherwise
    turn_form : what three angles of the gripper are, None where that is open
    loose_quaternion : columns of one whose components are numbered so that nothing tells which is the scalar
    axes : the tissue's x, y, z in the source's axes
    noise : standard deviations that rows at rest show, by name, in SI units
    """

    source: Source
    times: dict[str, Proposed]
    channels: dict[str, Proposed]
    gripper: tuple[Point, ...]
    beads: tuple[Point, ...]
    all_points: int
    force_of: str | None
    force_frame: str
    turn_form: str | None
    loose_quaternion: tuple[str, ...]
    axes: tuple[str, str, str]
    noise: dict[str, float]


def propose(source: Source) -> Proposal:
    """Understand a source as far as it can be."""
    times: dict[str, Proposed] = {}
    channels: dict[str, Proposed] = {}
    for table in source.tables:
        for column in table.columns:
            role = role_of(column)
            if role.kind == "time":
                times.setdefault(table.name, _proposed("time", source, table, column, role))
            elif role.kind in _LETTER:
                target = f"{_LETTER[role.kind]}{role.axis}"
                channels.setdefault(target, _proposed(target, source, table, column, role))
    channels, loose = _with_numbered(_consistent(channels), source)
    points = points_of(source)
    has_motion = any(target in channels for target in ("p", "px", "py", "pz"))
    gripper = tuple(point for point in points if point.on_gripper) if not has_motion else ()
    others = [point for point in points if not any(point is one for one in gripper)]
    return Proposal(
        source=source,
        times=times,
        channels=channels,
        gripper=gripper,
        beads=tuple(spread(others, MOST_BEADS)),
        all_points=len(others),
        force_of=_force_of(channels, times),
        force_frame=_frame_of_its_own(channels),
        turn_form=_turn_form(channels),
        loose_quaternion=loose,
        axes=_axes(source),
        noise=_noise(channels, others, times),
    )


def _proposed(target: str, source: Source, table: Table, column: Column, role: Role) -> Proposed:
    needs = role.kind not in (None, "quaternion")
    return Proposed(target, table, column, source.name_of(table, column), role.unit, needs)


def _consistent(channels: dict[str, Proposed]) -> dict[str, Proposed]:
    """Leave out a travel or force of no axis where there are some of an axis, and quaternions in part."""
    kept = dict(channels)
    for letter in "pf":
        if any(f"{letter}{axis}" in kept for axis in "xyz"):
            kept.pop(letter, None)
    if not all(f"q{axis}" in kept for axis in "wxyz"):
        parts = {axis: kept.pop(f"q{axis}") for axis in "wxyz" if f"q{axis}" in kept}
        if set(parts) == set("xyz") and not any(f"r{axis}" in kept for axis in "xyz"):
            # an orientation of three numbers is of angles
            kept |= {
                f"r{axis}": replace(one, target=f"r{axis}", needs_unit=True) for axis, one in parts.items()
            }
    return kept


def _with_numbered(
    channels: dict[str, Proposed], source: Source
) -> tuple[dict[str, Proposed], tuple[str, ...]]:
    """Add a quaternion whose components are numbered; return those names, too, whose order nothing tells."""
    if any(f"{letter}{axis}" in channels for letter in "qr" for axis in "wxyz"):
        return channels, ()
    for table in source.tables:
        found = numbered_quaternion(table)
        if found is not None and found.from_zero:
            targets = zip(("qw", "qx", "qy", "qz"), found.columns, strict=True)
            added = {
                one: _proposed(one, source, table, column, Role("quaternion")) for one, column in targets
            }
            return channels | added, ()
        if found is not None:
            return channels, tuple(source.name_of(table, column) for column in found.columns)
    return channels, ()


def _turn_form(channels: dict[str, Proposed]) -> str | None:
    """Return what three angles are, as a mapping states it; None where that is open.

    Roll, pitch and yaw turn about fixed axes. A rotation vector is stated in radians; degrees may be of any order.
    """
    turns = [channels[name] for name in ("rx", "ry", "rz") if name in channels]
    if any(re.search("roll|pitch|yaw", one.column.name, re.IGNORECASE) for one in turns):
        return "xyz"
    return "rotation vector" if all(one.unit == "rad" for one in turns) else None


def _force_of(channels: dict[str, Proposed], times: dict[str, Proposed]) -> str | None:
    """Return whether a force is that on the gripper, by the sign of the work that it does; None where that is open.

    Work on a body from rest is never negative, so the force that the tissue exerts on the gripper points against the
    motion on the whole.
    """
    work, effort = 0.0, 0.0
    for force, motion in (("fx", "px"), ("fy", "py"), ("fz", "pz"), ("f", "p")):
        one, other = channels.get(force), channels.get(motion)
        read = None if one is None or other is None else _beside(one, other.table, times)
        if one is None or other is None or read is None:
            continue
        values, place = read, other.column.values * _factor(other)
        # a sensor may be zeroed while the test rests
        before = values[: rows_at_rest([place])][-_RIGHT_BEFORE:]
        known = before[np.isfinite(before)]
        values = (values - (np.median(known) if len(known) else _first(values))) * _factor(one)
        end = int(np.nanargmax(np.abs(place - _first(place)))) + 1
        step = np.diff(place[:end])
        mean = (values[1:end] + values[: end - 1]) / 2
        both = np.isfinite(step) & np.isfinite(mean)
        work -= float(np.sum(mean[both] * step[both]))
        effort += float(np.sum(np.abs(mean[both] * step[both])))
    if effort == 0 or abs(work) < 0.5 * effort:
        return None
    return "tissue on gripper" if work > 0 else "gripper on tissue"


def _frame_of_its_own(channels: dict[str, Proposed]) -> str:
    """Return the frame of the force as the file states it, where the motion is stated in another."""
    force, motion = (
        next((channels[name].table.facts.get("frame", "") for name in names if name in channels), "")
        for names in (("fx", "fy", "fz"), ("px", "py", "pz"))
    )
    return force if force and motion and force != motion else ""


def _beside(one: Proposed, base: Table, times: dict[str, Proposed]) -> FloatArray | None:
    """Return a column at the rows of a table, by the clocks of both; None where one has none."""
    if one.table.name == base.name:
        return one.column.values
    if not {one.table.name, base.name} <= times.keys():
        return None
    own, wanted = (_seconds(times[table.name]) for table in (one.table, base))
    known = np.isfinite(own) & np.isfinite(one.column.values)
    if known.sum() < 2:
        return None
    order = np.argsort(own[known], kind="stable")
    values = one.column.values[known][order]
    return np.interp(wanted, own[known][order], values, left=np.nan, right=np.nan)


def _seconds(time: Proposed) -> FloatArray:
    return np.asarray(time.column.values * UNITS["time"].get(spelt(time.unit or ""), 1.0))


def _axes(source: Source) -> tuple[str, str, str]:
    """Return axes whose z is up: an image's y points down; a C3D file says which of its axes goes up the screen."""
    if source.y_down:
        return "x", "-y", "-z"
    for table in source.tables:
        up = table.facts.get("POINT:Y_SCREEN", "").strip().lower()
        if up in ("+y", "y"):
            return "x", "-z", "y"
        if up == "-y":
            return "x", "z", "-y"
        if up == "-z":
            return "x", "-y", "-z"
    return "x", "y", "z"


def _noise(
    channels: dict[str, Proposed], points: Sequence[Point], times: dict[str, Proposed]
) -> dict[str, float]:
    """Return the scatter of rows before any motion, from differences of neighbouring rows."""
    motion = [channels[name] for name in ("p", "px", "py", "pz") if name in channels]
    if not motion:
        return {}
    at_rest = _Rest(motion[0].table, rows_at_rest([one.column.values for one in motion]), times)
    found: dict[str, float] = {}
    for name, targets in (("force_std", ("f", "fx", "fy", "fz")), ("torque_std", ("tx", "ty", "tz"))):
        series = [
            at_rest.of(channels[one].table, channels[one].column) * _factor(channels[one])
            for one in targets
            if one in channels
        ]
        _add(found, name, series)
    coordinates = [
        at_rest.of(point.table, column) * UNITS["length"][spelt(point.unit)]
        for point in points[:MOST_BEADS]
        for column in point.columns
        if column is not None and point.unit is not None and spelt(point.unit) in UNITS["length"]
    ]
    _add(found, "fiducial_std", coordinates)
    return found


@dataclass(frozen=True, slots=True)
class _Rest:
    """How many rows of a table are at rest, and by the clocks those of any other."""

    table: Table
    rows: int
    times: dict[str, Proposed]

    def of(self, table: Table, column: Column) -> FloatArray:
        """Return the values of a column at rest; without clocks as many rows as of the motion."""
        if table.name == self.table.name or not {table.name, self.table.name} <= self.times.keys():
            return column.values[: self.rows]
        end = _seconds(self.times[self.table.name])[self.rows - 1]
        return column.values[_seconds(self.times[table.name]) <= end]


def _add(found: dict[str, float], name: str, series: Iterable[FloatArray]) -> None:
    differences = [np.diff(one) for one in series]
    kept = np.concatenate(differences) if differences else np.zeros(0)
    kept = kept[np.isfinite(kept)]
    if len(kept) >= _FEWEST_AT_REST - 1 and (std := float(np.sqrt(np.mean(kept**2) / 2))) > 0:
        found[name] = float(f"{std:.2g}")


def _first(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(known[0]) if len(known) else 0.0


def _factor(proposed: Proposed) -> float:
    quantity = QUANTITY_OF[
        "force" if proposed.target[0] == "f" else "torque" if proposed.target[0] == "t" else "position"
    ]
    return UNITS[quantity].get(spelt(proposed.unit or ""), 1.0)
