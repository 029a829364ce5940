"""Writes experiment folders; a reader sees a whole one or none."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from estimator.errors import InputError
from estimator.experiment.holds import Box, PaintedPatch
from estimator.experiment.model import (
    EXPERIMENT_FILE,
    FORMAT,
    OBSERVATIONS_FILE,
    PAINTING_PREFIX,
    REGION_PREFIX,
    SURFACE_FILES,
    Experiment,
    Phantom,
)
from estimator.experiment.observations import write_observations
from estimator.experiment.toml_values import toml_axes, toml_box, toml_number, toml_text, toml_vector
from estimator.experiment.validation import check_experiment

# How the files of regions and painted patches begin.
_OWN = (REGION_PREFIX, PAINTING_PREFIX)
_GRASP = "grasp"


def write_experiment(experiment: Experiment, path: Path | str) -> Experiment:
    """Write a new experiment folder and return the experiment with that path.

    Raises
    ------
    InputError
        Something is there already, or the experiment does not pass the checks; nothing is written then.
    """
    target = Path(path)
    if target.exists():
        raise InputError(f"{target}: exists already; give another name, or remove it first")
    with _staged(experiment, target) as staged:
        staged.rename(target)
    _sync(target.parent)
    return _located(experiment, target)


def replace_experiment(experiment: Experiment, path: Path | str) -> Experiment:
    """Write over the experiment folder at ``path`` (there need be none) and return it with that path.

    Raises
    ------
    InputError
        The folder there holds anything but an experiment, or the experiment does not pass the checks; the old
        folder stays as it was then.
    """
    target = Path(path)
    if not target.exists():
        return write_experiment(experiment, target)
    if not (target / EXPERIMENT_FILE).exists():
        raise InputError(f"{target}: is no experiment folder, and would be lost; move it away first")
    known = {EXPERIMENT_FILE, OBSERVATIONS_FILE, *SURFACE_FILES}
    found = (entry.name for entry in target.iterdir())
    if foreign := sorted(name for name in found if name not in known and not name.startswith(_OWN)):
        raise InputError(f"{target}: holds {foreign[0]}, which would be lost; move it away first")
    with _staged(experiment, target) as staged:
        old = staged.with_name(staged.name + ".old")
        target.rename(old)
        try:
            staged.rename(target)
        except OSError:
            old.rename(target)
            raise
    _sync(target.parent)
    shutil.rmtree(old)
    return _located(experiment, target)


@contextmanager
def _staged(experiment: Experiment, target: Path) -> Iterator[Path]:
    """Write the whole folder beside its target, under a hidden name; remove it unless it is renamed."""
    check_experiment(replace(experiment, path=target))
    target.parent.mkdir(parents=True, exist_ok=True)
    staged = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
    try:
        staged.chmod(0o755)
        (staged / EXPERIMENT_FILE).write_text(_toml(experiment), encoding="utf-8")
        write_observations(staged / OBSERVATIONS_FILE, experiment)
        if experiment.phantom.surface is not None:
            shutil.copyfile(experiment.phantom.surface, staged / _surface_name(experiment.phantom.surface))
        for region in experiment.phantom.regions:
            shutil.copyfile(region.surface, staged / region.file_name)
        for name, held in _held(experiment).items():
            if isinstance(held, PaintedPatch):
                shutil.copyfile(held.file, staged / _painting_name(name, held))
        for file in staged.iterdir():
            _sync(file)
        yield staged
    finally:
        if staged.exists():
            shutil.rmtree(staged)


def _held(experiment: Experiment) -> dict[str, Box]:
    anchors = {f"anchor_{number}": anchor for number, anchor in enumerate(experiment.anchors, start=1)}
    rollers = {f"roller_{number}": roller.box for number, roller in enumerate(experiment.rollers, start=1)}
    led = {f"prescribed_{number}": one.box for number, one in enumerate(experiment.prescribed, start=1)}
    return {**anchors, **rollers, **led, _GRASP: experiment.grasp.box}


def _painting_name(name: str, held: PaintedPatch) -> str:
    return f"{PAINTING_PREFIX}{name}{held.file.suffix.lower()}"


def _held_lines(name: str, held: Box) -> list[str]:
    if not isinstance(held, PaintedPatch):
        return [f"box = {toml_box(held)}"]
    return [
        f"painted = {toml_text(_painting_name(name, held))}",
        f"scalar = {toml_text(held.scalar)}",
        f"value = {toml_number(held.value)}",
        *([] if held.unit is None else [f"unit = {toml_text(held.unit)}"]),
    ]


def _located(experiment: Experiment, target: Path) -> Experiment:
    if experiment.phantom.surface is None:
        return replace(experiment, path=target)
    phantom = replace(
        experiment.phantom,
        surface=target / _surface_name(experiment.phantom.surface),
        regions=tuple(
            replace(region, surface=target / region.file_name) for region in experiment.phantom.regions
        ),
    )
    held = {
        name: replace(one, file=target / _painting_name(name, one)) if isinstance(one, PaintedPatch) else one
        for name, one in _held(experiment).items()
    }
    mounted = replace(
        experiment,
        anchors=tuple(held[name] for name in held if name.startswith("anchor_")),
        rollers=tuple(
            replace(one, box=held[f"roller_{number}"])
            for number, one in enumerate(experiment.rollers, start=1)
        ),
        prescribed=tuple(
            replace(one, box=held[f"prescribed_{number}"])
            for number, one in enumerate(experiment.prescribed, start=1)
        ),
        grasp=replace(experiment.grasp, box=held[_GRASP]),
    )
    return replace(mounted, phantom=phantom, path=target)


def _surface_name(file: Path) -> str:
    return next(
        (name for name in SURFACE_FILES if Path(name).suffix == file.suffix.lower()), SURFACE_FILES[-1]
    )


def _toml(experiment: Experiment) -> str:
    sensor, environment = experiment.sensor, experiment.environment
    held = {name: _held_lines(name, one) for name, one in _held(experiment).items()}
    anchors = [lines for name, lines in held.items() if name.startswith("anchor_")]
    directed = [
        ["", "[[roller]]", *held[f"roller_{number}"], f"directions = {toml_axes(one.directions)}"]
        for number, one in enumerate(experiment.rollers, start=1)
    ]
    directed += [
        [
            *("", "[[prescribed]]", *held[f"prescribed_{number}"]),
            f"directions = {toml_axes(one.directions)}",
            f"reach = {toml_number(one.reach)}",
        ]
        for number, one in enumerate(experiment.prescribed, start=1)
    ]
    grasp = experiment.grasp
    rest = [f"    {toml_vector(tuple(point))}," for point in experiment.fiducials_rest.tolist()]
    lines = [
        f"format = {toml_text(FORMAT)}",
        f"name = {toml_text(experiment.name)}",
        f"phantom_id = {toml_text(experiment.phantom_id)}",
        f"order = {experiment.order}",
        "",
        *phantom_lines(experiment.phantom),
        *(line for lines in anchors for line in ("", "[[anchor]]", *lines)),
        *(line for lines in directed for line in lines),
        "",
        "[grasp]",
        *held[_GRASP],
        f"centre = {toml_vector(grasp.centre)}",
        *([f"directions = {toml_axes(grasp.directions)}"] if grasp.slides else []),
        "",
        "[trajectory]",
        f"kind = {toml_text(experiment.trajectory_kind)}",
        f"first_row = {toml_text(experiment.first_row)}",
        f"driven = {toml_text(experiment.driven)}",
        "",
        "[environment]",
        f"gravity = {toml_vector(environment.gravity)}",
        f"surface_below = {toml_text(environment.surface_below)}",
        f"weight = {toml_text(environment.weight)}",
        "",
        "[sensor]",
        f"force_std = {toml_number(sensor.force_std)}",
        f"torque_std = {toml_number(sensor.torque_std)}",
        f"fiducial_std = {toml_number(sensor.fiducial_std)}",
        f"position_std = {toml_number(sensor.position_std)}",
        f"orientation_std = {toml_number(sensor.orientation_std)}",
        f"tool_mass = {toml_number(sensor.tool_mass)}",
        f"tool_centre = {toml_vector(sensor.tool_centre)}",
        f"force_zero = {toml_text(sensor.force_zero)}",
        *(["", "[sensor.by_channel]"] if sensor.by_channel else []),
        *(f"{name} = {toml_number(std)}" for name, std in sensor.by_channel.items()),
        "",
        "[fiducials]",
        "rest = [",
        *rest,
        "]",
        "",
    ]
    return "\n".join(lines)


def phantom_lines(phantom: Phantom) -> list[str]:
    """Return the table of a phantom, with those of its regions; their files lie in the same folder."""
    surface = [] if phantom.surface is None else [f"surface = {toml_text(_surface_name(phantom.surface))}"]
    unit = [] if phantom.unit is None else [f"unit = {toml_text(phantom.unit)}"]
    lines = [
        "[phantom]",
        f"shape = {toml_text(phantom.shape)}",
        *surface,
        *unit,
        f"size = {toml_vector(phantom.size_m)}",
        f"density = {toml_number(phantom.density)}",
        *([] if phantom.stays_flat is None else [f"stays_flat = {str(phantom.stays_flat).lower()}"]),
    ]
    for region in phantom.regions:
        lines += [
            "",
            "[[phantom.region]]",
            f"name = {toml_text(region.name)}",
            f"surface = {toml_text(region.file_name)}",
            *([] if region.unit is None else [f"unit = {toml_text(region.unit)}"]),
            f"modulus_ratio = {toml_number(region.modulus_ratio)}",
        ]
    return lines


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
