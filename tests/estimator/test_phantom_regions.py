"""Phantoms with stiffer regions, and with painted anchors and grasps: written, read, and posed."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import (
    Environment,
    Experiment,
    Grasp,
    PaintedPatch,
    Phantom,
    SensorNoise,
    TissueRegion,
    check_same_mounting,
    read_experiment,
    replace_experiment,
    write_experiment,
)
from estimator.experiment.holds import Box
from estimator.experiment_checks import findings_of
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.shares import nodal_volumes
from estimator.forward.meshing import mesh_experiment, surface_notes
from estimator.geometry.shapes import block_surface
from estimator.surfaces.surface import Surface
from estimator.surfaces.writing import write_ply

FloatArray = NDArray[np.float64]

SIZE = (0.08, 0.04, 0.03)
COARSE = Grading(grasp_m=2e-3, anchor_m=6e-3, largest_m=16e-3, growth=2.6, layers=1)
ANCHOR, GRASP = 1, 2


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RETRACT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def painted_ply(file: Path, *, by_face: bool = False) -> Path:
    """Paint the ends of the block: 1 at -x, 2 at +x."""
    surface = block_surface(SIZE, (16, 8, 6))
    x = surface.corners.mean(axis=1)[:, 0] if by_face else surface.vertices[:, 0]
    values = np.where(x < -0.0399, ANCHOR, np.where(x > 0.0399, GRASP, 0))
    data = {"held": [values.astype(np.int32)]} if by_face else None
    nodes = None if by_face else {"held": values.astype(np.int32)}
    mesh = meshio.Mesh(surface.vertices, [("triangle", surface.triangles)], point_data=nodes, cell_data=data)
    mesh.write(file)
    return file


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("phantom")
    write_ply(block_surface(SIZE, (16, 8, 6)), folder / "body.ply")
    lump = block_surface((0.02, 0.02, 0.02), (4, 4, 4))
    write_ply(Surface(lump.vertices + np.array([0.01, 0.0, 0.0]), lump.triangles), folder / "lump.ply")
    return folder


def experiment(
    folder: Path, regions: tuple[TissueRegion, ...] = (), patches: Path | None = None
) -> Experiment:
    anchor: Box = Box((-0.0401, -0.021, -0.016), (-0.0399, 0.021, 0.016))
    grasp: Box = Box((0.0399, -0.021, -0.016), (0.0401, 0.021, 0.016))
    if patches is not None:
        anchor = PaintedPatch((-0.04, -0.02, -0.015), (-0.04, 0.02, 0.015), "held", ANCHOR, patches, "m")
        grasp = PaintedPatch((0.04, -0.02, -0.015), (0.04, 0.02, 0.015), "held", GRASP, patches, "m")
    beads = np.array([[0.0, 0.0, 0.015], [-0.02, 0.01, 0.015], [0.02, -0.01, 0.015]])
    return Experiment(
        name="pull",
        phantom_id="P1",
        order=1,
        phantom=Phantom("surface", SIZE, folder / "body.ply", unit="m", regions=regions),
        anchors=(anchor,),
        grasp=Grasp(grasp, (0.04, 0.0, 0.0)),
        trajectory_kind="pull",
        environment=Environment(),
        sensor=SensorNoise(0.02, 5e-4, 5e-5, 3e-5),
        fiducials_rest=beads,
        time=np.array([0.0, 1.0]),
        phase=("hold", "ramp"),
        step=np.array([0, 1]),
        position=np.array([[0.04, 0.0, 0.0], [0.042, 0.0, 0.0]]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)),
        wrench=np.array([[0.0] * 6, [-0.5, 0, 0, 0, 0, 0]]),
        fiducials=np.stack([beads, beads + np.array([0.001, 0, 0])]),
    )


def test_a_region_is_as_much_stiffer_as_it_says_in_as_much_of_the_tissue(folder: Path) -> None:
    lump = TissueRegion("lump", folder / "lump.ply", 3.0)
    stiffer = mesh_experiment(experiment(folder, (lump,)), COARSE)
    log_factor = np.log(stiffer.body.modulus) / np.log(3.0)
    assert (log_factor * stiffer.body.rest_volume).sum() == pytest.approx(8e-6, rel=0.05)
    assert log_factor.min() >= -1e-12
    assert log_factor.max() <= 1 + 1e-12
    (note,) = surface_notes(experiment(folder, (lump,)), COARSE)
    assert note.endswith("region lump is taken as 3 times as stiff as the rest, whose parameters are told")
    # mass and areas are those of the mesh
    assert nodal_volumes(stiffer.body.mesh).sum() == pytest.approx(np.prod(SIZE), rel=0.01)


def test_regions_in_one_place_multiply(folder: Path) -> None:
    one, other = (TissueRegion(name, folder / "lump.ply", ratio) for name, ratio in (("a", 2.0), ("b", 3.0)))
    both = mesh_experiment(experiment(folder, (one, other)), COARSE)
    six = mesh_experiment(experiment(folder, (replace(one, modulus_ratio=6.0),)), COARSE)
    assert both.body.volume == pytest.approx(six.body.volume)


def test_a_region_off_the_tissue_is_refused(folder: Path, tmp_path: Path) -> None:
    lump = block_surface((0.02, 0.02, 0.02))
    write_ply(Surface(lump.vertices + 0.5, lump.triangles), tmp_path / "off.ply")
    with pytest.raises(InputError, match=r"off.ply: region a holds no tissue; is it in the same frame\?"):
        mesh_experiment(experiment(folder, (TissueRegion("a", tmp_path / "off.ply", 2.0),)), COARSE)


@pytest.mark.parametrize(("name", "by_face"), [("a.ply", False), ("a.vtu", False), ("a.vtu", True)])
def test_painted_ends_hold_what_boxes_at_the_ends_hold(
    folder: Path, tmp_path: Path, name: str, by_face: bool
) -> None:
    boxes = mesh_experiment(experiment(folder), COARSE)
    painted = mesh_experiment(
        experiment(folder, patches=painted_ply(tmp_path / name, by_face=by_face)), COARSE
    )
    for nodes, at in (("fixed", -0.04), ("gripped", 0.04)):
        for problem in (boxes, painted):
            held = problem.body.mesh.points[getattr(problem, nodes)]
            assert held[:, 0] == pytest.approx(at, abs=3e-4)
            assert np.ptp(held, axis=0)[1:] == pytest.approx(SIZE[1:], rel=0.1)
    assert not painted.fiducials_gripped.any()


def test_regions_and_patches_are_written_with_their_files_and_read_back(folder: Path, tmp_path: Path) -> None:
    lump = TissueRegion("lump", folder / "lump.ply", 3.0, "m")
    stated = experiment(folder, (lump,), painted_ply(tmp_path / "a.ply"))
    written = write_experiment(stated, tmp_path / "pull")
    assert {file.name for file in (tmp_path / "pull").iterdir()} == {
        *("experiment.toml", "observations.csv", "phantom.ply", "region_lump.ply"),
        *("painted_anchor_1.ply", "painted_grasp.ply"),
    }
    found = read_experiment(tmp_path / "pull")
    assert (found.phantom, found.anchors, found.grasp) == (written.phantom, written.anchors, written.grasp)
    assert isinstance(found.anchors[0], PaintedPatch)
    assert found.anchors[0].lower == pytest.approx((-0.04, -0.02, -0.015))
    check_same_mounting([found, replace(stated, fiducials_rest=found.fiducials_rest)])
    assert [finding for finding in findings_of(found) if finding.grade == "wrong"] == []
    replace_experiment(found, tmp_path / "pull")
    other = replace(found, phantom=replace(found.phantom, regions=()))
    with pytest.raises(InputError, match=r"\[phantom\] differ"):
        check_same_mounting([found, other])


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "value = 1.0",
            "value = 7.0",
            r"\[\[anchor\]\] 1 value is 7, and held of .* has 0, 1, 2; write one of these",
        ),
        (
            'scalar = "held"',
            'scalar = "colour"',
            "has no single number 'colour' at its corners or faces; it has held",
        ),
        ("modulus_ratio = 3.0", "modulus_ratio = 0.0", "modulus_ratio is 0; write a ratio of moduli"),
        ('name = "lump"', 'name = "../lump"', "give each region a name of letters, digits, _ and -"),
        ('"painted_anchor_1.ply"', '"nothing.ply"', "nothing.ply: there is no such file"),
    ],
)
def test_what_cannot_be_is_refused(folder: Path, tmp_path: Path, old: str, new: str, told: str) -> None:
    lump = TissueRegion("lump", folder / "lump.ply", 3.0, "m")
    write_experiment(experiment(folder, (lump,), painted_ply(tmp_path / "a.ply")), tmp_path / "pull")
    file = tmp_path / "pull" / "experiment.toml"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=told):
        read_experiment(tmp_path / "pull")
