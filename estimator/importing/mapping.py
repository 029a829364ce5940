"""What the columns of a source are in an experiment: the file ``retraction-import/1``."""

import re
from collections.abc import Mapping as MappingOf
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Literal, cast

import numpy as np

from estimator.errors import InputError
from estimator.experiment.holds import AXES, Axis, Vector
from estimator.experiment.model import TRAJECTORY_KINDS, SensorNoise
from estimator.experiment.observations import WRENCH_COLUMNS
from estimator.experiment.tables import TomlTable
from estimator.importing.frames import rotation_of_axes
from estimator.importing.table import FloatArray
from estimator.input_file import parse_toml, read_input_text

FORMAT = "retraction-import/1"
UNKNOWN = "?"
POSITIONS = ("px", "py", "pz")
QUATERNION = ("qw", "qx", "qy", "qz")
TURNS = ("rx", "ry", "rz")
ALONG = ("p", "f")
"""Travel and force of a machine that has one axis."""
TARGETS: tuple[str, ...] = (*POSITIONS, *QUATERNION, *TURNS, *WRENCH_COLUMNS, *ALONG)

ROTATION_VECTOR = "rotation vector"
ORDERS = tuple("".join(order) for axes in ("xyz", "XYZ") for order in permutations(axes))
"""Turns about three axes one after the other: fixed ones in small letters, in capitals those that turn along."""

ForceOf = Literal["tissue on gripper", "gripper on tissue"]
ForceAlong = Literal["source", "gripper"]
Shape = Literal["block", "cylinder", "surface"]
_FACE = re.compile(r"([xyz])([+-])(?:\s+(\S+))?")
_HEADING = re.compile(r"\[{1,2}\w+\]{1,2}")
_OPEN = re.compile(r"""(?P<quote>["'])\?(?P=quote)""")


@dataclass(frozen=True, slots=True)
class Channel:
    """A column that is used, its unit, and the sign that it gets."""

    column: str
    unit: str
    sign: float = 1.0


@dataclass(frozen=True, slots=True)
class Clock:
    """Time of the rows of a table: a column, or a rate; ``offset_s`` is added."""

    table: str
    time: Channel | None
    rate_hz: float | None
    offset_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Face:
    """Tissue at a face of the phantom, ``x+`` to ``z-``, down to a depth, m."""

    axis: int
    upper: bool
    depth: float


@dataclass(frozen=True, slots=True)
class BoxText:
    """A box as the mapping states it: two corners, m, or a face."""

    corners: tuple[Vector, Vector] | None
    face: Face | None


@dataclass(frozen=True, slots=True, eq=False)
class Beads:
    """Columns of each bead along the source's x, y and z, empty where one was not measured, and their unit.

    ``plane_z`` is the tissue frame's z of beads whose z was not measured, m.
    """

    columns: tuple[tuple[str, str, str], ...]
    unit: str
    plane_z: float | None


@dataclass(frozen=True, slots=True, eq=False)
class ImportMapping:
    """A whole mapping; lengths in m unless a channel has its unit."""

    file: Path
    name: str
    phantom_id: str
    order: int
    clocks: tuple[Clock, ...]
    rows: tuple[int, int | None, int]
    channels: MappingOf[str, Channel]
    turn_form: str
    machine_axis: FloatArray | None
    gripper_points: tuple[tuple[str, str, str], ...]
    gripper_unit: str
    force_of: ForceOf
    force_along: ForceAlong
    zeroed: bool
    R_tissue_source: FloatArray
    origin: Vector
    beads: Beads
    shape: Shape
    size: Vector | None
    surface: Path | None
    density: float
    stays_flat: bool | None
    anchors: tuple[BoxText, ...]
    rollers: tuple[tuple[BoxText, tuple[Axis, ...]], ...]
    grasp: BoxText
    grasp_directions: tuple[Axis, ...]
    centre: Vector | None
    kind: str
    gravity: Vector
    surface_below: str
    noise: SensorNoise


def open_lines(file: Path) -> list[tuple[int, str]]:
    """Return the lines of a mapping that are still to be filled in, with their keys.

    Raises
    ------
    InputError
        It cannot be read.
    """
    found, heading = [], ""
    for number, line in enumerate(read_input_text(file).splitlines(), start=1):
        code = line.split("#", 1)[0]
        if _HEADING.fullmatch(code.strip()):
            heading = code.strip()
        elif _OPEN.search(code):
            found.append((number, f"{heading} {code.partition('=')[0].strip()}".strip()))
    return found


def read_mapping(file: Path) -> ImportMapping:
    """Read a mapping in which nothing is left open.

    Raises
    ------
    InputError
        It cannot be read, a key is missing or of another type, or lines are still to be filled in.
    """
    text = read_input_text(file)
    missing = open_lines(file)
    if missing:
        shown = "; ".join(f"line {number} ({key})" for number, key in missing)
        raise InputError(f"{file}: fill in what could not be known: {shown}; then run the command again")
    root = TomlTable(parse_toml(text, file), file)
    if (found := root.text("format")) != FORMAT:
        raise InputError(f'{file}: format is "{found}"; only "{FORMAT}" can be read')
    plain = parse_toml(text, file)
    columns = plain.get("columns", {})
    unknown = sorted(set(columns) - set(TARGETS)) if isinstance(columns, dict) else []
    if unknown:
        raise InputError(
            f"{file}: [columns] {unknown[0]} is nothing of an experiment; write {', '.join(TARGETS)}"
        )
    gripper, beads, frame = root.table("gripper"), root.table("beads"), root.table("frame")
    phantom, rows = root.table("phantom"), root.table("rows")
    shape = cast(Shape, phantom.choice("shape", ("block", "cylinder", "surface")))
    sensor = root.table("sensor")
    return ImportMapping(
        file=file,
        name=root.text("name", file.stem),
        phantom_id=root.text("phantom_id", "phantom"),
        order=root.integer("order", 1),
        clocks=tuple(_clock(table) for table in root.tables("clock")),
        rows=(
            rows.integer("first", 1),
            rows.integer("last") if "last" in rows else None,
            rows.integer("most", 60),
        ),
        channels={
            key: _channel(root.table("columns").table(key)) for key in TARGETS if key in root.table("columns")
        },
        turn_form=root.table("turn").choice("angles", (ROTATION_VECTOR, *ORDERS), ROTATION_VECTOR),
        machine_axis=_machine_axis(root, columns),
        gripper_points=_points(plain, "gripper", file),
        gripper_unit=gripper.text("unit", "mm"),
        force_of=cast(
            ForceOf,
            root.table("force").choice(
                "is_of", ("tissue on gripper", "gripper on tissue"), "tissue on gripper"
            ),
        ),
        force_along=cast(ForceAlong, root.table("force").choice("along", ("source", "gripper"), "source")),
        zeroed=root.table("force").choice("zero", ("at rest", "as it is"), "at rest") == "at rest",
        R_tissue_source=rotation_of_axes(
            plain.get("frame", {}).get("axes", ["x", "y", "z"]), f"{file}: [frame] axes"
        ),
        origin=frame.vector("origin", (0.0, 0.0, 0.0)),
        beads=Beads(
            _points(plain, "beads", file),
            beads.text("unit", "mm"),
            beads.number("plane_z") if "plane_z" in beads else None,
        ),
        shape=shape,
        size=phantom.vector("size") if shape != "surface" or "size" in phantom else None,
        surface=_beside(file, phantom.text("surface")) if shape == "surface" else None,
        density=phantom.number("density", 1070.0),
        anchors=tuple(_box(table, "box", file, "[[anchor]]") for table in root.tables("anchor")),
        stays_flat=phantom.flag("stays_flat") if "stays_flat" in phantom else None,
        rollers=tuple(
            (_box(table, "box", file, "[[roller]]"), table.axes("directions"))
            for table in root.tables("roller")
        ),
        grasp=_box(root.table("grasp"), "box", file, "[grasp]"),
        grasp_directions=root.table("grasp").axes("directions", AXES),
        centre=root.table("grasp").vector("centre") if "centre" in root.table("grasp") else None,
        kind=root.table("trajectory").choice("kind", TRAJECTORY_KINDS, "other"),
        gravity=root.table("environment").vector("gravity", (0.0, 0.0, -9.81)),
        surface_below=root.table("environment").choice("surface_below", ("table", "none"), "table"),
        noise=SensorNoise(
            force_std=sensor.number("force_std"),
            torque_std=sensor.number("torque_std"),
            fiducial_std=sensor.number("fiducial_std"),
            position_std=sensor.number("position_std"),
        ),
    )


def _channel(table: TomlTable) -> Channel:
    sign = table.number("sign", 1.0)
    return Channel(table.text("column"), table.text("unit", ""), -1.0 if sign < 0 else 1.0)


def _machine_axis(root: TomlTable, columns: object) -> FloatArray | None:
    """Return the direction in the source's axes along which ``p`` and ``f`` count positive."""
    if not (isinstance(columns, dict) and any(name in columns for name in ALONG)):
        return None
    axis = root.table("machine").choice("axis", ("x", "y", "z", "-x", "-y", "-z", "+x", "+y", "+z"))
    direction = np.zeros(3)
    direction["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return direction


def _clock(table: TomlTable) -> Clock:
    return Clock(
        table.text("table"),
        _channel(table.table("time")) if "time" in table else None,
        table.number("rate_hz") if "rate_hz" in table else None,
        table.number("offset_s", 0.0),
    )


def _points(plain: MappingOf[str, object], key: str, file: Path) -> tuple[tuple[str, str, str], ...]:
    table = plain.get(key, {})
    value = table.get("columns", []) if isinstance(table, dict) else []
    rows = [row for row in value if isinstance(row, list)] if isinstance(value, list) else []
    if not isinstance(value, list) or len(rows) != len(value):
        raise InputError(
            f"{file}: [{key}] columns is {value!r:.60}; write a list of [x, y, z] for each point"
        )
    for row in rows:
        if not (2 <= len(row) <= 3 and all(isinstance(name, str) for name in row)):
            raise InputError(
                f"{file}: [{key}] columns holds {row!r:.80}; write the names of three columns, "
                '"" where none was measured'
            )
    return tuple((row[0], row[1], row[2] if len(row) == 3 else "") for row in rows)


def _box(table: TomlTable, key: str, file: Path, heading: str) -> BoxText:
    """Read two corners, or a face such as "z+" or "z+ 0.002"."""
    try:
        text = table.text(key)
    except InputError:
        box = table.box(key)
        return BoxText((box.lower, box.upper), None)
    match = _FACE.fullmatch(text.strip())
    try:
        depth = float(match[3]) if match and match[3] else 0.0
    except ValueError:
        match, depth = None, 0.0
    if match is None or depth < 0:
        raise InputError(
            f'{file}: {heading} {key} is "{text}"; write two corners in metres, or a face with a depth in metres, '
            'as in "z+ 0.002"'
        )
    return BoxText(None, Face("xyz".index(match[1]), match[2] == "+", depth))


def _beside(mapping: Path, name: str) -> Path:
    path = Path(name)
    return path if path.is_absolute() else mapping.parent / path
