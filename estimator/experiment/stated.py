"""What the tables of an ``experiment.toml`` state of phantom, mounting, surroundings and sensor."""

import re
from pathlib import Path
from typing import cast, get_args

import numpy as np

from estimator.errors import InputError
from estimator.experiment.holds import AXES, Box, Grasp, PaintedPatch, Prescribed, Roller
from estimator.experiment.model import (
    BEAD_CHANNELS,
    FORMAT,
    WRENCH_CHANNELS,
    Environment,
    ForceZero,
    Phantom,
    SensorNoise,
    SurfaceBelow,
    TissueRegion,
    Weight,
)
from estimator.experiment.tables import TomlTable
from estimator.surfaces.formats.painting import read_painting
from estimator.surfaces.reading import surface_bounds
from estimator.surfaces.units import UNITS, Unit

_REGION_NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")

# Keys that the format before the newest did not know, by table; "" is the file's head.
_NEWER_KEYS: dict[str, tuple[str, ...]] = {
    "": ("roller", "prescribed"),
    "phantom": ("region", "stays_flat"),
    "grasp": ("painted", "directions"),
    "environment": ("weight",),
    "sensor": ("force_zero", "orientation_std"),
    "trajectory": ("first_row", "driven"),
}
_NEWER_KEYS_OF_ANCHORS = ("painted",)


def refuse_newer_keys(stated: TomlTable, file: Path) -> None:
    """Refuse what an older format would pass over in silence.

    Raises
    ------
    InputError
        The file has a key that only the newest format knows.
    """
    tables = {f"[{name}] " if name else "": stated.table(name) if name else stated for name in _NEWER_KEYS}
    found = [
        f"{label}{key}"
        for (label, table), keys in zip(tables.items(), _NEWER_KEYS.values(), strict=True)
        for key in keys
        if key in table
    ]
    for number, anchor in enumerate(stated.tables("anchor"), start=1):
        found += [f"[[anchor]] {number} {key}" for key in _NEWER_KEYS_OF_ANCHORS if key in anchor]
    if found:
        raise InputError(f'{file}: {found[0]} needs format = "{FORMAT}"; write that at the head')


def phantom_of(table: TomlTable, folder: Path) -> Phantom:
    """Return the body that a table [phantom] states."""
    density = table.number("density", 1070.0)
    stays_flat = table.flag("stays_flat") if "stays_flat" in table else None
    if table.choice("shape", ("block", "surface")) == "block":
        return Phantom("block", table.vector("size"), None, density, stays_flat=stays_flat)
    if stays_flat:
        raise table.error(
            "stays_flat", "is for phantoms of shape block; give a surface its thickness, or a block's size"
        )
    surface = folder / table.text("surface")
    unit = cast(Unit, table.choice("unit", UNITS)) if "unit" in table else None
    x, y, z = np.ptp(surface_bounds(surface, unit), axis=0).tolist()
    size, regions = table.vector("size", (x, y, z)), _regions(table, folder)
    return Phantom("surface", size, surface, density, unit, regions)


def _regions(table: TomlTable, folder: Path) -> tuple[TissueRegion, ...]:
    found = list[TissueRegion]()
    for stated in table.tables("region"):
        name, ratio = stated.text("name"), stated.number("modulus_ratio")
        if not _REGION_NAME.fullmatch(name) or name in [region.name for region in found]:
            raise stated.error("name", f'is "{name}"; give each region a name of letters, digits, _ and -')
        if not 1e-3 <= ratio <= 1e3:
            raise stated.error("modulus_ratio", f"is {ratio:g}; write a ratio of moduli of 0.001 to 1000")
        unit = cast(Unit, stated.choice("unit", UNITS)) if "unit" in stated else None
        found.append(TissueRegion(name, folder / stated.text("surface"), ratio, unit))
    return tuple(found)


def _held(table: TomlTable, folder: Path, phantom: Phantom) -> Box:
    """Return the box that is held, or the patch of a surface that a painting shows."""
    if "painted" not in table:
        return table.box("box")
    if phantom.surface is None:
        raise table.error("painted", "is for phantoms of shape surface; give a block's box")
    file, scalar, value = folder / table.text("painted"), table.text("scalar"), table.number("value", 1.0)
    unit = cast(Unit, table.choice("unit", UNITS)) if "unit" in table else phantom.unit
    painting = read_painting(file, scalar, unit)
    points = painting.points[painting.has(value)]
    if not len(points):
        found = ", ".join(f"{one:g}" for one in np.unique(painting.values)[:12])
        raise table.error("value", f"is {value:g}, and {scalar} of {file} has {found}; write one of these")
    (x0, y0, z0), (x1, y1, z1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return PaintedPatch((x0, y0, z0), (x1, y1, z1), scalar, value, file, unit)


def grasp_of(table: TomlTable, folder: Path, phantom: Phantom) -> Grasp:
    """Return what the gripper holds."""
    box = _held(table, folder, phantom)
    x, y, z = np.mean([box.lower, box.upper], axis=0).tolist()
    return Grasp(box, table.vector("centre", (x, y, z)), table.axes("directions", AXES))


def anchors_of(stated: TomlTable, folder: Path, phantom: Phantom) -> tuple[Box, ...]:
    """Return what stands still."""
    tables = stated.tables("anchor")
    for table in tables:
        if "directions" in table:
            raise table.error(
                "directions", "is for what holds some directions only; head that table with [[roller]]"
            )
    return tuple(_held(table, folder, phantom) for table in tables)


def rollers_of(stated: TomlTable, folder: Path, phantom: Phantom) -> tuple[Roller, ...]:
    """Return what holds some directions only."""
    return tuple(
        Roller(_held(table, folder, phantom), table.axes("directions")) for table in stated.tables("roller")
    )


def prescribed_of(stated: TomlTable, folder: Path, phantom: Phantom) -> tuple[Prescribed, ...]:
    """Return where the tissue moves as was measured."""
    return tuple(
        Prescribed(_held(table, folder, phantom), table.axes("directions", AXES), table.number("reach", 0.0))
        for table in stated.tables("prescribed")
    )


def environment_of(table: TomlTable) -> Environment:
    """Return what surrounds the phantom."""
    default = Environment()
    below = table.choice("surface_below", ("table", "none"), default.surface_below)
    weight = table.choice("weight", get_args(Weight), default.weight)
    return Environment(
        table.vector("gravity", default.gravity), cast(SurfaceBelow, below), cast(Weight, weight)
    )


def sensor_of(table: TomlTable) -> SensorNoise:
    """Return the noise of the sensors and the tool."""
    return SensorNoise(
        force_std=table.number("force_std"),
        torque_std=table.number("torque_std"),
        fiducial_std=table.number("fiducial_std"),
        position_std=table.number("position_std"),
        tool_mass=table.number("tool_mass", 0.0),
        tool_centre=table.vector("tool_centre", (0.0, 0.0, 0.0)),
        by_channel=_by_channel(table.table("by_channel")) if "by_channel" in table else {},
        orientation_std=table.number("orientation_std", 0.0),
        force_zero=cast(ForceZero, table.choice("force_zero", get_args(ForceZero), "first_row")),
    )


def _by_channel(table: TomlTable) -> dict[str, float]:
    return {name: table.number(name) for name in (*WRENCH_CHANNELS, *BEAD_CHANNELS) if name in table}
