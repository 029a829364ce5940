"""Reads experiment folders and cases; what comes back has passed every check."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args

import numpy as np

from estimator.errors import InputError
from estimator.experiment.as_modelled import as_modelled
from estimator.experiment.model import (
    BEAD_CHANNELS,
    EXPERIMENT_FILE,
    FORMAT,
    FORMATS,
    OBSERVATIONS_FILE,
    TRAJECTORY_KINDS,
    WRENCH_CHANNELS,
    Box,
    Driven,
    Environment,
    Experiment,
    FirstRow,
    ForceZero,
    Grasp,
    PaintedPatch,
    Phantom,
    SensorNoise,
    SurfaceBelow,
    TissueRegion,
    TrajectoryKind,
    Vector,
    Weight,
)
from estimator.experiment.observations import read_observations
from estimator.experiment.tables import TomlTable
from estimator.experiment.validation import check_experiment
from estimator.surfaces.formats.painting import read_painting
from estimator.surfaces.reading import surface_bounds
from estimator.surfaces.units import UNITS, Unit

PHANTOM_FORMAT = "retraction-phantom/1"
"""Of a file that states a phantom and, where it is mounted already, how."""

_REGION_NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")


@dataclass(frozen=True, slots=True)
class MountedPhantom:
    """A phantom, and how it is held.

    Attributes
    ----------
    phantom, anchors, grasp, environment : as those of an experiment
    fiducials_rest : m
    """

    phantom: Phantom
    anchors: tuple[Box, ...]
    grasp: Grasp
    environment: Environment
    fiducials_rest: tuple[Vector, ...]


def read_mounted_phantom(path: Path | str) -> MountedPhantom:
    """Read a phantom and how it is held from a file of its own, with the tables that an experiment has for it.

    Raises
    ------
    InputError
        Something is missing, unreadable, or of another type.
    """
    file = Path(path)
    stated = TomlTable.read(file)
    if (found := stated.text("format")) != PHANTOM_FORMAT:
        raise InputError(f'{file}: format is "{found}"; a phantom has "{PHANTOM_FORMAT}"')
    phantom = _phantom(stated.table("phantom"), file.parent)
    anchors = tuple(_held(anchor, file.parent, phantom) for anchor in stated.tables("anchor"))
    if not anchors or "grasp" not in stated:
        raise InputError(
            f"{file}: states no {'[[anchor]]' if not anchors else '[grasp]'}; add where the phantom is held, as in an "
            "experiment.toml"
        )
    rest = [(x, y, z) for x, y, z in stated.table("fiducials").points("rest").tolist()]
    grasp = _grasp(stated.table("grasp"), file.parent, phantom)
    return MountedPhantom(phantom, anchors, grasp, _environment(stated.table("environment")), tuple(rest))


def read_experiment(path: Path | str) -> Experiment:
    """Read and check one experiment folder; quaternions come back with unit norm to the last digit.

    A first row of the phantom free of stress, before its weight acts, is left out once it is checked, and what is empty
    of a known load is zero.

    Unknown keys are ignored. Keys that may be missing: ``name`` (then the folder's name), ``phantom_id`` (the
    name of the folder above), ``order`` (1), ``density`` (1070), the grasp's ``centre`` (its box's), ``kind``
    ("other"), ``first_row`` ("at_rest"), ``driven`` ("pose"), ``gravity`` (0, 0, −9.81), ``surface_below`` ("table"),
    ``weight`` ("left_out"), ``force_zero`` ("first_row"), ``orientation_std`` (0), ``tool_mass`` (0), ``tool_centre``
    (0, 0, 0), a surface's ``size`` (its bounding box's) and ``unit`` (metres; millimetres where only these give a
    phantom), and the whole table of fiducials (none).

    Raises
    ------
    InputError
        Something is missing, unreadable or implausible; the message names file, line and column or key.
    """
    experiment = read_unchecked(path)
    check_experiment(experiment)
    norm = np.linalg.norm(experiment.quaternion_wxyz, axis=1, keepdims=True)
    return as_modelled(replace(experiment, quaternion_wxyz=experiment.quaternion_wxyz / norm))


def read_unchecked(path: Path | str) -> Experiment:
    """Read one experiment folder as it stands, whatever its values say.

    Raises
    ------
    InputError
        Something is missing, unreadable, or of another type.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; give a folder that holds {EXPERIMENT_FILE}")
    file = folder / EXPERIMENT_FILE
    stated = TomlTable.read(file)
    if (found := stated.text("format")) not in FORMATS:
        raise InputError(f'{file}: format is "{found}"; only {" and ".join(FORMATS)} can be read')
    if found != FORMAT:
        _refuse_newer_keys(stated, file)
    fiducials_rest = stated.table("fiducials").points("rest")
    observed = read_observations(folder / OBSERVATIONS_FILE, len(fiducials_rest))
    phantom = _phantom(stated.table("phantom"), folder)
    trajectory = stated.table("trajectory")
    kind = trajectory.choice("kind", TRAJECTORY_KINDS, "other")
    return Experiment(
        name=stated.text("name", folder.resolve().name),
        phantom_id=stated.text("phantom_id", folder.resolve().parent.name),
        order=stated.integer("order", 1),
        phantom=phantom,
        anchors=tuple(_held(anchor, folder, phantom) for anchor in stated.tables("anchor")),
        grasp=_grasp(stated.table("grasp"), folder, phantom),
        trajectory_kind=cast(TrajectoryKind, kind),
        environment=_environment(stated.table("environment")),
        sensor=_sensor(stated.table("sensor")),
        fiducials_rest=fiducials_rest,
        time=observed.time - observed.time[0],
        phase=observed.phase,
        step=observed.step,
        position=observed.position,
        quaternion_wxyz=observed.quaternion_wxyz,
        wrench=observed.wrench,
        fiducials=observed.fiducials,
        path=folder,
        first_row=cast(FirstRow, trajectory.choice("first_row", get_args(FirstRow), "at_rest")),
        driven=cast(Driven, trajectory.choice("driven", get_args(Driven), "pose")),
    )


def read_case(path: Path | str) -> list[Experiment]:
    """Read a folder of experiments of one phantom, sorted by ``order``, or one experiment as a list of one.

    Raises
    ------
    InputError
        The folder holds no experiment, or experiments of several phantoms; or as :func:`read_experiment`.
    """
    folder = Path(path)
    members = case_members(folder)
    if members == [folder]:
        return [read_experiment(folder)]
    experiments = [read_experiment(member) for member in members]
    phantoms = sorted({experiment.phantom_id for experiment in experiments})
    if len(phantoms) > 1:
        raise InputError(
            f"{folder}: experiments of {len(phantoms)} phantoms ({', '.join(phantoms)}); a case is of one: "
            "sort them into folders, or correct phantom_id"
        )
    return sorted(experiments, key=lambda experiment: experiment.order)


def case_members(path: Path | str) -> list[Path]:
    """Return the experiment folders that a folder holds, or the folder itself where it is one.

    Raises
    ------
    InputError
        It is neither an experiment nor a folder of experiments.
    """
    folder = Path(path)
    if (folder / EXPERIMENT_FILE).exists():
        return [folder]
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; give an experiment or a folder of experiments")
    members = sorted(file.parent for file in folder.glob(f"*/{EXPERIMENT_FILE}"))
    if not members:
        raise InputError(
            f"{folder}: neither it nor a folder in it holds {EXPERIMENT_FILE}; give another folder"
        )
    return members


def _refuse_newer_keys(stated: TomlTable, file: Path) -> None:
    """Refuse what an older format would pass over in silence."""
    newer = {
        "environment": ("weight",),
        "sensor": ("force_zero", "orientation_std"),
        "trajectory": ("first_row", "driven"),
    }
    for table, keys in newer.items():
        for key in keys:
            if key in stated.table(table):
                raise InputError(f'{file}: [{table}] {key} needs format = "{FORMAT}"; write that at the head')


def _phantom(table: TomlTable, folder: Path) -> Phantom:
    density = table.number("density", 1070.0)
    if table.choice("shape", ("block", "surface")) == "block":
        return Phantom("block", table.vector("size"), None, density)
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


def _grasp(table: TomlTable, folder: Path, phantom: Phantom) -> Grasp:
    box = _held(table, folder, phantom)
    x, y, z = np.mean([box.lower, box.upper], axis=0).tolist()
    return Grasp(box, table.vector("centre", (x, y, z)))


def _environment(table: TomlTable) -> Environment:
    default = Environment()
    below = table.choice("surface_below", ("table", "none"), default.surface_below)
    weight = table.choice("weight", get_args(Weight), default.weight)
    return Environment(
        table.vector("gravity", default.gravity), cast(SurfaceBelow, below), cast(Weight, weight)
    )


def _sensor(table: TomlTable) -> SensorNoise:
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
