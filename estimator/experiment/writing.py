"""Writes experiment folders; a reader sees a whole one or none."""

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from estimator.errors import InputError
from estimator.experiment.model import (
    EXPERIMENT_FILE,
    FORMAT,
    OBSERVATIONS_FILE,
    SURFACE_FILES,
    Box,
    Experiment,
    Vector,
)
from estimator.experiment.observations import write_observations
from estimator.experiment.validation import check_experiment


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
    if foreign := sorted(entry.name for entry in target.iterdir() if entry.name not in known):
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
        for file in staged.iterdir():
            _sync(file)
        yield staged
    finally:
        if staged.exists():
            shutil.rmtree(staged)


def _located(experiment: Experiment, target: Path) -> Experiment:
    if experiment.phantom.surface is None:
        return replace(experiment, path=target)
    phantom = replace(experiment.phantom, surface=target / _surface_name(experiment.phantom.surface))
    return replace(experiment, phantom=phantom, path=target)


def _surface_name(file: Path) -> str:
    return next(
        (name for name in SURFACE_FILES if Path(name).suffix == file.suffix.lower()), SURFACE_FILES[-1]
    )


def _toml(experiment: Experiment) -> str:
    phantom, sensor, environment = experiment.phantom, experiment.sensor, experiment.environment
    surface = [] if phantom.surface is None else [f"surface = {_text(_surface_name(phantom.surface))}"]
    unit = [] if phantom.unit is None else [f"unit = {_text(phantom.unit)}"]
    anchors = [line for anchor in experiment.anchors for line in ("", "[[anchor]]", f"box = {_box(anchor)}")]
    rest = [f"    {_vector(tuple(point))}," for point in experiment.fiducials_rest.tolist()]
    lines = [
        f"format = {_text(FORMAT)}",
        f"name = {_text(experiment.name)}",
        f"phantom_id = {_text(experiment.phantom_id)}",
        f"order = {experiment.order}",
        "",
        "[phantom]",
        f"shape = {_text(phantom.shape)}",
        *surface,
        *unit,
        f"size = {_vector(phantom.size_m)}",
        f"density = {_number(phantom.density)}",
        *anchors,
        "",
        "[grasp]",
        f"box = {_box(experiment.grasp.box)}",
        f"centre = {_vector(experiment.grasp.centre)}",
        "",
        "[trajectory]",
        f"kind = {_text(experiment.trajectory_kind)}",
        f"first_row = {_text(experiment.first_row)}",
        f"driven = {_text(experiment.driven)}",
        "",
        "[environment]",
        f"gravity = {_vector(environment.gravity)}",
        f"surface_below = {_text(environment.surface_below)}",
        f"weight = {_text(environment.weight)}",
        "",
        "[sensor]",
        f"force_std = {_number(sensor.force_std)}",
        f"torque_std = {_number(sensor.torque_std)}",
        f"fiducial_std = {_number(sensor.fiducial_std)}",
        f"position_std = {_number(sensor.position_std)}",
        f"orientation_std = {_number(sensor.orientation_std)}",
        f"tool_mass = {_number(sensor.tool_mass)}",
        f"tool_centre = {_vector(sensor.tool_centre)}",
        f"force_zero = {_text(sensor.force_zero)}",
        *(["", "[sensor.by_channel]"] if sensor.by_channel else []),
        *(f"{name} = {_number(std)}" for name, std in sensor.by_channel.items()),
        "",
        "[fiducials]",
        "rest = [",
        *rest,
        "]",
        "",
    ]
    return "\n".join(lines)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _number(value: float) -> str:
    return repr(float(value))


def _vector(vector: Vector) -> str:
    return f"[{', '.join(_number(value) for value in vector)}]"


def _box(box: Box) -> str:
    return f"[{_vector(box.lower)}, {_vector(box.upper)}]"


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
