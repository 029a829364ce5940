"""Organs that tests share: with a cavity, a stiffer region, and where they are held painted on their surface."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.experiment import (
    Environment,
    Experiment,
    Grasp,
    PaintedPatch,
    Phantom,
    SensorNoise,
    TissueRegion,
)
from estimator.geometry.organ import organ_surface
from estimator.geometry.shapes import sphere_surface
from estimator.surfaces.queries import nearest
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface
from estimator.surfaces.writing import write_ply

FloatArray = NDArray[np.float64]

FREE, ANCHOR, GRASP = 0, 1, 2
LENGTH_M = 0.16
RATIO = 3.0
CYST, TUMOUR = (-0.035, 0.0, 0.002), (0.0, 0.0, 0.004)


def ball(centre: tuple[float, float, float], radius_m: float) -> Surface:
    """A sphere of 320 triangles."""
    sphere = sphere_surface(radius_m, 2)
    return Surface(sphere.vertices + np.array(centre), sphere.triangles)


def hollow_organ(outer: Surface, *hollow: Surface) -> Surface:
    """The organ with cavities."""
    starts = np.cumsum([0, *(len(one.vertices) for one in (outer, *hollow))])
    return closed_surface(
        np.concatenate([one.vertices for one in (outer, *hollow)]),
        np.concatenate(
            [one.triangles + start for one, start in zip((outer, *hollow), starts[:-1].tolist(), strict=True)]
        ),
        "organ",
    )


def organ(folder: Path, subdivisions: int = 3) -> Experiment:
    """An organ with a cyst and a tumour, held at its painted thick end, gripped at its painted thin lobe.

    Returns
    -------
    Two rows of a pull, of which nothing but the plan is true
    """
    outer = organ_surface(2, LENGTH_M, subdivisions)
    body = hollow_organ(outer, ball(CYST, 0.010))
    write_ply(body, folder / "organ.ply")
    write_ply(ball(TUMOUR, 0.012), folder / "tumour.ply")
    x = outer.vertices[:, 0]
    painted = np.where(x < -0.055, ANCHOR, np.where(x > 0.058, GRASP, FREE)).astype(np.int32)
    meshio.Mesh(outer.vertices, [("triangle", outer.triangles)], point_data={"held": painted}).write(
        folder / "held.vtu"
    )
    anchor, grasp = (_patch(outer, painted, value, folder / "held.vtu") for value in (ANCHOR, GRASP))
    wanted = np.array([(x, y, 0.05) for x in (-0.04, -0.01, 0.02, 0.04) for y in (-0.015, 0.015)])
    _, beads = nearest(outer.corners, wanted)
    centre = (0.065, 0.0, float(np.mean([grasp.lower[2], grasp.upper[2]])))
    tumour = TissueRegion("tumour", folder / "tumour.ply", RATIO, "m")
    size_x, size_y, size_z = np.ptp(body.bounds, axis=0).tolist()
    rest = np.array(centre)
    return Experiment(
        name="pull",
        phantom_id="organ",
        order=1,
        phantom=Phantom("surface", (size_x, size_y, size_z), folder / "organ.ply", 1070.0, "m", (tumour,)),
        anchors=(anchor,),
        grasp=Grasp(grasp, centre),
        trajectory_kind="pull",
        environment=Environment(),
        sensor=SensorNoise(0.02, 5e-4, 5e-5, 3e-5),
        fiducials_rest=beads,
        time=np.array([0.0, 1.0]),
        phase=("hold", "ramp"),
        step=np.array([0, 1]),
        position=np.array([rest, rest + np.array([0.006, 0.0, 0.0])]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)),
        wrench=np.zeros((2, 6)),
        fiducials=np.stack([beads, beads]),
    )


@contextmanager
def organ_meshed_anew(folders: pytest.TempPathFactory, subdivisions: int = 3) -> Iterator[Experiment]:
    """The organ, with a cache of meshes of its own meanwhile."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RETRACT_CACHE", str(folders.mktemp("cache")))
        yield organ(folders.mktemp("organ"), subdivisions)


def _patch(surface: Surface, painted: NDArray[np.int32], value: int, file: Path) -> PaintedPatch:
    corners = surface.vertices[painted == value]
    (x0, y0, z0), (x1, y1, z1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return PaintedPatch((x0, y0, z0), (x1, y1, z1), "held", float(value), file, "m")
