"""What a case's folders state: the phantom, how it is held, rest positions, and readings with their noise."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.scenes.noise import with_noise
from estimator.blind.making.scenes.outline import Outline, surface_of
from estimator.blind.making.scenes.parts import Part
from estimator.blind.making.scenes.scene import SIZE, Mechanics, Readings, Scene
from estimator.blind.making.scenes.setup import Setup
from estimator.blind.making.scenes.sizing import stated_rest
from estimator.experiment import Box, Environment, Experiment, Grasp, Phantom, TissueRegion
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface
from estimator.surfaces.writing import write_stl

FloatArray = NDArray[np.float64]

# Boxes reach beyond what they hold by this, m.
_BEYOND = 1e-4
_GRASP_CENTRE = (0.04, 0.0, 0.0)


def experiments_of(
    setup: Setup, scene: Scene, readings: tuple[Readings, ...], random: np.random.Generator
) -> tuple[Experiment, ...]:
    """Return the experiments of a case as its folders have them, a phantom that is no block still without its file.

    Parameters
    ----------
    scene : with the effects
    readings : free of noise, one an experiment
    """
    phantom, anchors, grasp = stated_mounting(setup.mechanics)
    rest = stated_rest(setup, scene, readings)
    experiments = []
    for reading in readings:
        noisy = with_noise(reading, setup.sensor, setup.noise, random)
        rows = reading.rows
        experiments.append(
            Experiment(
                name=rows.kind,
                phantom_id=setup.phantom_id,
                order=rows.order,
                phantom=phantom,
                anchors=anchors,
                grasp=grasp,
                trajectory_kind=rows.kind,
                environment=Environment(),
                sensor=setup.sensor,
                fiducials_rest=rest,
                time=rows.time,
                phase=rows.phase,
                step=rows.step,
                position=noisy.position,
                quaternion_wxyz=np.round(rows.rotation.as_quat(scalar_first=True), 9),
                wrench=noisy.wrench,
                fiducials=noisy.beads,
            )
        )
    return tuple(experiments)


def stated_mounting(mechanics: Mechanics) -> tuple[Phantom, tuple[Box, ...], Grasp]:
    """Return phantom, anchors and grasp as the folders state them."""
    return _phantom(mechanics), _anchors(mechanics), _grasp(mechanics)


@contextmanager
def with_surface_files(
    experiments: Sequence[Experiment], outline: Outline | None, parts: Sequence[Part] = ()
) -> Iterator[tuple[Experiment, ...]]:
    """Give experiments whose phantom has STL files of its surface and its regions, for as long as they are needed."""
    if outline is None:
        yield tuple(experiments)
        return
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "phantom.stl"
        write_stl(_surface(outline, parts), file)
        regions = []
        for number, part in enumerate((one for one in parts if one.kind == "region"), start=1):
            region = TissueRegion(f"part_{number}", Path(folder) / f"{number}.stl", part.modulus_ratio)
            write_stl(closed_surface(*part.surface(outline), region.name), region.surface)
            regions.append(region)
        yield tuple(
            replace(one, phantom=replace(one.phantom, surface=file, regions=tuple(regions)))
            for one in experiments
        )


def _surface(outline: Outline, parts: Sequence[Part] = ()) -> Surface:
    shells = [surface_of(outline)]
    for part in parts:
        if part.kind == "cavity":
            vertices, triangles = part.surface(outline)
            shells.append((vertices, triangles[:, ::-1]))
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in shells)])
    return closed_surface(
        np.concatenate([vertices for vertices, _ in shells]),
        np.concatenate([triangles + n for (_, triangles), n in zip(shells, starts[:-1], strict=True)]),
        "phantom",
    )


def _phantom(mechanics: Mechanics) -> Phantom:
    if mechanics.outline is None:
        return Phantom("block", SIZE)
    x, y, z = map(float, np.ptp(_surface(mechanics.outline).vertices, axis=0))
    return Phantom("surface", (x, y, z))


def _extent(mechanics: Mechanics) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper corner of a box a little larger than the body, m."""
    if mechanics.outline is None:
        half = np.array(SIZE) / 2
        return -half - _BEYOND, half + _BEYOND
    vertices = _surface(mechanics.outline).vertices
    return vertices.min(axis=0) - _BEYOND, vertices.max(axis=0) + _BEYOND


def _anchors(mechanics: Mechanics) -> tuple[Box, ...]:
    low, high = _extent(mechanics)
    at_x = _box(low, np.array([-SIZE[0] / 2 + _BEYOND, high[1], high[2]]))
    if not mechanics.two_sides:
        return (at_x,)
    return at_x, _box(np.array([low[0], SIZE[1] / 2 - _BEYOND, low[2]]), high)


def _grasp(mechanics: Mechanics) -> Grasp:
    low, high = _extent(mechanics)
    (x_low, x_high), (y_low, y_high) = mechanics.grasp_x, mechanics.grasp_y
    lower = np.array([x_low, max(y_low, low[1]), low[2]])
    return Grasp(_box(lower, np.array([x_high, min(y_high, high[1]), high[2]])), _GRASP_CENTRE)


def _box(lower: FloatArray, upper: FloatArray) -> Box:
    return Box(*(tuple(np.round(corner, 6).tolist()) for corner in (lower, upper)))
