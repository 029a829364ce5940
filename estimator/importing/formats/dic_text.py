"""Exports of digital image correlations as text, a file a frame: DICe, VIC-3D, MatchID, GOM and ZEISS, muDIC."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.importing.formats.fields import Frames, reference_of, table_of_frames
from estimator.importing.formats.grids import read_text_file
from estimator.importing.table import Column, FloatArray, Source, Table, require_tables
from estimator.importing.units import is_unit

# along x, y, z: the first name of each program that is found
_COORDINATES = (
    (r"coordinate_x", r"coordinate_y", r"coordinate_z"),  # DICe; GOM scripts
    (r"coor\.x", r"coor\.y", r"coor\.z"),  # MatchID
    (
        r"x_undef\w*|x0|x_ref",
        r"y_undef\w*|y0|y_ref",
        r"z_undef\w*|z0|z_ref",
    ),  # ZEISS through its data exporter
    (r"x", r"y", r"z"),  # VIC-3D, GOM, muDIC
)
_DISPLACEMENTS = (
    (r"displacement_x", r"displacement_y", r"displacement_z"),
    (r"disp\.horizontal displacement u", r"disp\.vertical displacement v", r"disp\.out-of-plane: w"),
    (r"displacement x", r"displacement y", r"displacement z"),
    (r"u_?x", r"u_?y", r"u_?z"),
    (r"d_?x", r"d_?y", r"d_?z"),
    (r"u", r"v", r"w"),
)
_LOST = {"sigma": -1.0}  # DICe and VIC-3D write so where a subset was lost
_IDS = ("subset_id", "id", "index", "point id", "point_id", "facet id")
_DOWNWARDS = ("dice", "mudic")


def is_field(table: Table) -> bool:
    """Tell whether the rows of a table are points of a field: coordinates and displacements, and no time."""
    names = [_plain(column.name) for column in table.columns]
    return (
        _found(names, _COORDINATES) is not None
        and _found(names, _DISPLACEMENTS) is not None
        and "time" not in names
    )


def read_frames(files: Sequence[Path], tables: Sequence[Table], path: Path) -> Source:
    """Return the points of files that are frames of one field, in the order of the numbers in their names.

    A point is told by its number where the file has one, else by its undeformed place.

    Raises
    ------
    InputError
        The files do not agree in their columns, or have no point in common.
    """
    order = sorted(range(len(files)), key=lambda place: natural(files[place].name))
    read = [_frame(files[place], tables[place]) for place in order]
    program, unit = read[0].program, read[0].unit
    keys = [key for key in read[0].keys if all(key in one.keys for one in read)]
    if not keys:
        raise InputError(f"{path}: the frames have no point in common; export one grid for all frames")
    places = [[one.keys[key] for key in keys] for one in read]
    coordinates = np.stack([one.coordinates[rows] for one, rows in zip(read, places, strict=True)])
    moved = np.stack([one.displacement[rows] for one, rows in zip(read, places, strict=True)])
    facts = {"program": program, "frames": ", ".join(file.name for file in files[:3])}
    frames = Frames(reference_of(coordinates, moved), moved, unit, facts)
    table = table_of_frames(frames)
    how = f"{program}, {len(files)} frames of {len(keys)} points"
    return Source(
        path, require_tables(path, [table], f"is read as {how}"), how, y_down=program.lower() in _DOWNWARDS
    )


def natural(name: str) -> tuple[tuple[int, int | str], ...]:
    """Return a key that sorts ``frame_2`` before ``frame_10``."""
    return tuple((0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", name) if part)


class _Frame:
    """Points of one file."""

    def __init__(
        self,
        program: str,
        unit: str | None,
        keys: dict[object, int],
        coordinates: FloatArray,
        displacement: FloatArray,
    ) -> None:
        self.program, self.unit, self.keys = program, unit, keys
        self.coordinates, self.displacement = coordinates, displacement


def _frame(file: Path, table: Table) -> _Frame:
    names = [_plain(column.name) for column in table.columns]
    where, moved = _found(names, _COORDINATES), _found(names, _DISPLACEMENTS)
    if where is None or moved is None:
        raise InputError(f"{file}: has not the coordinates and displacements that the frames beside it have")
    size = min(len(where), len(moved))
    coordinates = np.stack([table.columns[place].values for place in where[:size]], axis=1)
    displacement = np.stack([table.columns[place].values for place in moved[:size]], axis=1)
    for name, value in _LOST.items():
        if name in names:
            displacement[table.columns[names.index(name)].values == value] = np.nan
    number = next((names.index(name) for name in _IDS if name in names), None)
    labels = (
        table.columns[number].values.tolist()
        if number is not None
        else [tuple(point) for point in np.round(coordinates, 6).tolist()]
    )
    whole = np.asarray(np.isfinite(coordinates).all(axis=1))
    keys: dict[object, int] = {
        label: row for row, label in enumerate(labels) if whole[row] and not _is_nan(label)
    }
    unit = _unit(table.columns[where[0]])
    return _Frame(_program(names), unit, keys, coordinates, displacement)


def _is_nan(label: object) -> bool:
    return isinstance(label, float) and np.isnan(label)


def _found(names: Sequence[str], kinds: Sequence[tuple[str, ...]]) -> list[int] | None:
    """Return the places of x, y and, if there is one, z, of the first kind whose first two are there."""
    for kind in kinds:
        places = [
            next((place for place, name in enumerate(names) if re.fullmatch(pattern, name)), None)
            for pattern in kind
        ]
        if places[0] is not None and places[1] is not None:
            return [place for place in places if place is not None]
    return None


def _program(names: Sequence[str]) -> str:
    if "subset_id" in names:
        return "DICe"
    if "coor.x" in names:
        return "MatchID"
    if "true_strain_xx" in names:
        return "muDIC"
    if "sigma" in names or "u" in names:
        return "VIC-3D"
    return "GOM or ZEISS"


def _plain(name: str) -> str:
    """Return a name in small letters, without its unit and quotes."""
    return re.sub(r"\s*[(\[][^()\[\]]*[)\]]\s*$", "", name.strip().strip('"#').strip()).strip().lower()


def _unit(column: Column) -> str | None:
    stated = column.unit or next(iter(re.findall(r"[(\[]([^()\[\]]+)[)\]]\s*$", column.name)), None)
    return stated if is_unit(stated, "length") else None


def read_single(file: Path) -> Source:
    """Read one text file: columns along time, or one frame of a field, which tells no motion.

    Raises
    ------
    InputError
        It cannot be read, or is a single frame.
    """
    source = read_text_file(file)
    if is_field(source.tables[0]):
        raise InputError(f"{file}: is one frame of a field of points; name the folder that holds all frames")
    return source
