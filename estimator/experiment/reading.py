"""Reads experiment folders and cases; what comes back has passed every check."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args

import numpy as np

from estimator.errors import InputError
from estimator.experiment.as_modelled import as_modelled
from estimator.experiment.holds import Box, Grasp, Roller, Vector
from estimator.experiment.model import (
    EXPERIMENT_FILE,
    FORMAT,
    FORMATS,
    OBSERVATIONS_FILE,
    TRAJECTORY_KINDS,
    Driven,
    Environment,
    Experiment,
    FirstRow,
    Phantom,
    TrajectoryKind,
)
from estimator.experiment.observations import read_observations
from estimator.experiment.stated import (
    anchors_of,
    environment_of,
    grasp_of,
    phantom_of,
    prescribed_of,
    refuse_newer_keys,
    rollers_of,
    sensor_of,
)
from estimator.experiment.tables import TomlTable
from estimator.experiment.validation import check_experiment

PHANTOM_FORMAT = "retraction-phantom/1"
"""Of a file that states a phantom and, where it is mounted already, how."""


@dataclass(frozen=True, slots=True)
class MountedPhantom:
    """A phantom, and how it is held.

    Attributes
    ----------
    phantom, anchors, grasp, environment, rollers : as those of an experiment
    fiducials_rest : m
    """

    phantom: Phantom
    anchors: tuple[Box, ...]
    grasp: Grasp
    environment: Environment
    fiducials_rest: tuple[Vector, ...]
    rollers: tuple[Roller, ...] = ()


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
    phantom = phantom_of(stated.table("phantom"), file.parent)
    anchors = anchors_of(stated, file.parent, phantom)
    rollers = rollers_of(stated, file.parent, phantom)
    held = bool(anchors or rollers)
    if not held or "grasp" not in stated:
        raise InputError(
            f"{file}: states no {'[grasp]' if held else '[[anchor]]'}; add where the phantom is held, as in an "
            "experiment.toml"
        )
    rest = [(x, y, z) for x, y, z in stated.table("fiducials").points("rest").tolist()]
    grasp = grasp_of(stated.table("grasp"), file.parent, phantom)
    environment = environment_of(stated.table("environment"))
    return MountedPhantom(phantom, anchors, grasp, environment, tuple(rest), rollers)


def read_experiment(path: Path | str) -> Experiment:
    """Read and check one experiment folder; quaternions come back with unit norm to the last digit.

    A first row of the phantom free of stress, before its weight acts, is left out once it is checked, and what is empty
    of a known load is zero.

    Unknown keys are ignored. Keys that may be missing: ``name`` (then the folder's name), ``phantom_id`` (the
    name of the folder above), ``order`` (1), ``density`` (1070), the grasp's ``centre`` (its box's), ``kind``
    ("other"), ``first_row`` ("at_rest"), ``driven`` ("pose"), ``gravity`` (0, 0, −9.81), ``surface_below`` ("table"),
    ``weight`` ("left_out"), ``force_zero`` ("first_row"), ``orientation_std`` (0), ``tool_mass`` (0), ``tool_centre``
    (0, 0, 0), a surface's ``size`` (its bounding box's) and ``unit`` (metres; millimetres where only these give a
    phantom), ``stays_flat`` (false), the grasp's ``directions`` (all), the rollers (none), and the whole table of
    fiducials (none).

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
        refuse_newer_keys(stated, file)
    fiducials_rest = stated.table("fiducials").points("rest")
    observed = read_observations(folder / OBSERVATIONS_FILE, len(fiducials_rest))
    phantom = phantom_of(stated.table("phantom"), folder)
    trajectory = stated.table("trajectory")
    kind = trajectory.choice("kind", TRAJECTORY_KINDS, "other")
    return Experiment(
        name=stated.text("name", folder.resolve().name),
        phantom_id=stated.text("phantom_id", folder.resolve().parent.name),
        order=stated.integer("order", 1),
        phantom=phantom,
        anchors=anchors_of(stated, folder, phantom),
        grasp=grasp_of(stated.table("grasp"), folder, phantom),
        trajectory_kind=cast(TrajectoryKind, kind),
        environment=environment_of(stated.table("environment")),
        sensor=sensor_of(stated.table("sensor")),
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
        rollers=rollers_of(stated, folder, phantom),
        prescribed=prescribed_of(stated, folder, phantom),
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
