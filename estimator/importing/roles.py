"""What a column's name says that it is: a time, a force along an axis, a coordinate of a point."""

import re
from dataclasses import dataclass
from typing import Literal

from estimator.importing.table import Column
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
    (re.compile(r"q(?:uat)?[ _.\-]*([wxyz])"), "quaternion"),
    (re.compile(r"r(?:ot|otvec)?[ _.\-]*([xyz])"), "turn"),
    (
        re.compile(
            r"(?:p|pos|position|tcp|tool|ee|end_?effector|gripper|robot|stage|crosshead|disp|displacement)"
            r"[ _.\-]*([xyz])"
        ),
        "position",
    ),
)
_POINT = re.compile(r"(.*?\S)?[ _.:\-]*([xyz])", re.IGNORECASE)
_TIMES = {"time", "t", "timestamp", "zeit", "seconds", "elapsed time", "time stamp"}
_LONGEST = 200


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


def role_of(column: Column) -> Role:
    """Understand a column by its name and unit; a unit outranks a name."""
    title = understood(column.name[:_LONGEST], column.unit or "")
    unit = column.unit if quantity_of(column.unit) else _unit_in(column.name) or title.unit
    bare = _bare(column.name)
    # what groups an array stands in says nothing of it
    parts = bare.lower().split(".")
    if parts[-1] in _TIMES or title.quantity == "time":
        return Role("time", unit=_of("time", unit))
    for pattern, kind in _SHORT:
        match = pattern.fullmatch(".".join(parts[-2:])) or pattern.fullmatch(parts[-1])
        if match and (kind == "quaternion" or unit is None or quantity_of(unit) == QUANTITY_OF[kind]):
            return Role(kind, match[1], "", None if kind == "quaternion" else unit)
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
