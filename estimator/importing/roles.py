"""What a column's name says that it is: a time, a force along an axis, a coordinate of a point or a quaternion."""

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from estimator.importing.table import Column, Table
from estimator.importing.units import Quantity, quantity_of
from estimator.uniaxial.reading.language.titles import understood

Kind = Literal["time", "position", "force", "torque", "quaternion", "turn", "point"]

QUANTITY_OF: dict[Kind, Quantity] = {
    "time": "time",
    "position": "length",
    "force": "force",
    "torque": "torque",
    "turn": "angle",
    "point": "length",
}

_SHORT: tuple[tuple[re.Pattern[str], Kind], ...] = (
    (re.compile(r"(?:f|force|kraft)[ _.\-]*([xyz])\d*"), "force"),
    (re.compile(r"(?:t|m|torque|moment|mom)[ _.\-]*([xyz])\d*"), "torque"),
    (re.compile(r"(?:q|quat|quaternion|orientation|orient|rotation)[ _.\-]*([wxyz])"), "quaternion"),
    (re.compile(r"(?:r|rot|rotvec|euler|orientation|orient|rotation)[ _.\-]*([xyz])"), "turn"),
    (
        re.compile(
            r"(?:p|pos|position|tcp|tool|ee|end_?effector|gripper|robot|stage|crosshead|disp|displacement)"
            r"[ _.\-]*([xyz])"
        ),
        "position",
    ),
)
# A, B and C are an arm's turns about z, y and x
_NAMED_TURNS = {"roll": "x", "pitch": "y", "yaw": "z", "a": "z", "b": "y", "c": "x"}
_POINT = re.compile(r"(.*?\S)?[ _.:\-]*([xyz])", re.IGNORECASE)
_TIMES = {"time", "t", "timestamp", "zeit", "seconds", "elapsed time", "time stamp"}
_LONGEST = 200
_NUMBERED = re.compile(r"(?:.*[ _.:/])?(?:q|quat|quaternion|orientation)[ _.\-]*\[?(\d)\]?", re.IGNORECASE)
_UNIT_LENGTH = 0.02


@dataclass(frozen=True, slots=True)
class Role:
    """What a column is.

    Attributes
    ----------
    kind : of quantity, None where the name says nothing
    axis : ``x``, ``y``, ``z`` (``w`` of a quaternion), empty where the name says none
    point : name of the point whose coordinate it is, empty for anything else
    unit : as the file spells it, None where it says none that is known
    """

    kind: Kind | None
    axis: str = ""
    point: str = ""
    unit: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class NumberedQuaternion:
    """Four columns by their numbers; from 0 the first is the scalar by convention, from 1 either end may be."""

    columns: tuple[Column, ...]
    from_zero: bool


def role_of(column: Column) -> Role:
    """Understand a column by its name and unit; a unit outranks a name."""
    title = understood(column.name[:_LONGEST], column.unit or "")
    unit = column.unit if quantity_of(column.unit) else _unit_in(column.name) or title.unit
    bare = _bare(column.name)
    # what groups an array or a topic stands in says nothing of it
    parts = (bare.replace("/", ".") if bare.count("/") > 1 else bare).lower().split(".")
    if parts[-1] in _TIMES or title.quantity == "time":
        return Role("time", unit=_of("time", unit))
    for pattern, kind in _SHORT:
        match = pattern.fullmatch(".".join(parts[-2:])) or pattern.fullmatch(parts[-1])
        if match and (kind == "quaternion" or unit is None or quantity_of(unit) == QUANTITY_OF[kind]):
            return Role(kind, match[1], "", None if kind == "quaternion" else unit)
    if parts[-1] in _NAMED_TURNS and (len(parts[-1]) > 1 or quantity_of(unit) == "angle"):
        return Role("turn", _NAMED_TURNS[parts[-1]], "", _of("turn", unit))
    if title.quantity == "force":
        return Role("force", _axis_at_end(bare), "", _of("force", unit))
    if title.quantity in ("extension", "position", "height") and not _axis_at_end(bare):
        return Role("position", "", "", _of("position", unit))
    if title.quantity in ("strain", "stress") and title.measure is None:
        # with the gauge length as the unit of strain, and the section's load as that of stress
        return Role("position" if title.quantity == "strain" else "force")
    match = _POINT.fullmatch(bare)
    if match and (unit is None or quantity_of(unit) == "length"):
        return Role("point", match[2].lower(), (match[1] or "").rstrip(" _.:-"), unit)
    return Role(None, unit=unit)


def numbered_quaternion(table: Table) -> NumberedQuaternion | None:
    """Return four columns of unit length that are numbered 0 to 3 or 1 to 4; joints of a robot are none.

    Examples
    --------
    >>> names = ("q0", "q1", "q2", "q3")
    >>> parts = [Column(name, np.array([value, value])) for name, value in zip(names, (1.0, 0.0, 0.0, 0.0))]
    >>> found = numbered_quaternion(Table("pose", tuple(parts)))
    >>> found.from_zero, [column.name for column in found.columns]
    (True, ['q0', 'q1', 'q2', 'q3'])
    """
    numbered = {
        int(match[1]): column
        for column in table.columns
        if (match := _NUMBERED.fullmatch(column.name.strip())) is not None
    }
    if sorted(numbered) not in ([0, 1, 2, 3], [1, 2, 3, 4]):
        return None
    columns = tuple(numbered[number] for number in sorted(numbered))
    length = np.sqrt(sum(column.values**2 for column in columns))
    known = length[np.isfinite(length)]
    if not len(known) or np.abs(known - 1).max() > _UNIT_LENGTH:
        return None
    return NumberedQuaternion(columns, 0 in numbered)


def _of(kind: Kind, unit: str | None) -> str | None:
    return unit if unit is not None and quantity_of(unit) == QUANTITY_OF[kind] else None


def _unit_in(name: str) -> str | None:
    """Return the unit in brackets at the end of a name, or behind its last underscore."""
    match = re.search(r"[(\[]([^()\[\]]+)[)\]]\s*$", name) or re.search(r"[ _/]([^\s_/]+)$", name.strip())
    if match is None:
        return None
    # one letter behind an underscore is an axis or an index as often as metres
    return (
        match[1].strip()
        if quantity_of(match[1]) and (len(match[1]) > 1 or name.rstrip()[-1] in ")]" or match[1] in "Ns")
        else None
    )


def _bare(name: str) -> str:
    """Return a name without its unit."""
    unit = _unit_in(name)
    bare = re.sub(r"\s*[(\[][^()\[\]]*[)\]]\s*$", "", name).strip()
    if unit is not None and bare == name.strip():
        bare = bare[: -len(unit)].rstrip(" _/")
    return bare


def _axis_at_end(bare: str) -> str:
    match = re.search(r"(?:^|[ _.:\-])([xyz])$", bare, re.IGNORECASE)
    return match[1].lower() if match else ""
