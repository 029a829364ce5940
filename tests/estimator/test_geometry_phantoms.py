"""Experiments on phantoms given as a surface: posed, solved and compared with the block's own mesh, and the verb."""

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_files import ply_file

from daq.cli.bodies.mesh import add_parser
from daq.cli.verb import Result
from estimator.errors import InputError
from estimator.experiment import (
    Box,
    Environment,
    Experiment,
    Grasp,
    Phantom,
    SensorNoise,
    read_experiment,
    write_experiment,
)
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.forward.meshing import mesh_experiment, surface_notes
from estimator.geometry.shapes import block_surface
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.surfaces.writing import write_stl

FloatArray = NDArray[np.float64]

COARSE = Grading(grasp_m=1.2e-3, anchor_m=6e-3, largest_m=16e-3, growth=2.6, layers=1)
GRIPPED, ANCHORED = (0.045, 0.0, 0.005), (-0.048, 0.02, 0.005)
FREE = ((-0.03, -0.03, 0.005), (0.01, 0.01, 0.005), (0.01, -0.03, 0.005))


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RETRACT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def block_experiment() -> Experiment:
    beads = np.array([*FREE, GRIPPED, ANCHORED])
    return Experiment(
        name="pull",
        phantom_id="P1",
        order=1,
        phantom=Phantom("block", (0.1, 0.1, 0.01)),
        anchors=(Box((-0.0501, -0.0501, -0.0051), (-0.046, 0.0501, 0.0051)),),
        grasp=Grasp(Box((0.03, -0.01, -0.0051), (0.05, 0.01, 0.0051)), (0.04, 0.0, 0.0)),
        trajectory_kind="pull",
        environment=Environment(),
        sensor=SensorNoise(0.02, 5e-4, 5e-5, 3e-5),
        fiducials_rest=beads,
        time=np.array([0.0, 1.0]),
        phase=("hold", "ramp"),
        step=np.array([0, 1]),
        position=np.array([[0.04, 0.0, 0.0], [0.05, 0.0, 0.0]]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)),
        wrench=np.zeros((2, 6)),
        fiducials=np.stack([beads, beads]),
    )


@pytest.fixture(scope="module")
def as_surface(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    folder = tmp_path_factory.mktemp("surface")
    write_stl(block_surface((0.1, 0.1, 0.01)), folder / "block.stl")
    phantom = Phantom("surface", (0.1, 0.1, 0.01), folder / "block.stl")
    write_experiment(replace(block_experiment(), phantom=phantom), folder / "pull")
    return read_experiment(folder / "pull")


@pytest.fixture(scope="module")
def problem(as_surface: Experiment) -> RetractionProblem:
    return mesh_experiment(as_surface, COARSE)


def pulled(problem: RetractionProblem, poisson_ratio: float) -> Observation:
    """The observation after a pull of 10 mm along +x."""
    material = Material(NeoHookean(), 15e3, poisson_ratio)
    pose = GripperPose.from_quaternion(np.array([0.05, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    solver = EquilibriumSolver(problem)
    return observe(problem, solver.solve(pose, material, solver.rest(material)))


@pytest.mark.parametrize("poisson_ratio", [0.35, 0.49])
def test_a_block_given_as_a_surface_answers_as_the_block_does(
    problem: RetractionProblem, poisson_ratio: float
) -> None:
    # The mesher's runs differ: at nu 0.49 this coarse mesh is too stiff by 1.5 to 1.9 % in five of them.
    assert len(problem.body.mesh.cells) < 1500
    found = pulled(problem, poisson_ratio)
    expected = pulled(mesh_experiment(block_experiment()), poisson_ratio)
    assert found.wrench[0] == pytest.approx(expected.wrench[0], rel=0.03)
    assert found.wrench[1:3] == pytest.approx(0.0, abs=0.01 * abs(expected.wrench[0]))
    assert found.fiducials == pytest.approx(expected.fiducials, abs=2e-4)


def test_beads_in_held_tissue_move_with_the_gripper_or_stay(problem: RetractionProblem) -> None:
    assert problem.fiducials_gripped.tolist() == [False, False, False, True, False]
    moved = pulled(problem, 0.45).fiducials - problem.fiducials_rest
    assert moved[3] == pytest.approx([0.01, 0.0, 0.0], abs=1e-12)
    assert moved[4] == pytest.approx(0.0, abs=1e-12)
    assert np.all(moved[:3, 0] > 1e-4)


def test_a_second_call_poses_the_same_problem(as_surface: Experiment, problem: RetractionProblem) -> None:
    again = mesh_experiment(as_surface, COARSE)
    assert np.array_equal(again.body.mesh.points, problem.body.mesh.points)
    assert np.array_equal(again.body.mesh.cells, problem.body.mesh.cells)


def test_a_bead_off_the_tissue_is_refused(as_surface: Experiment, problem: RetractionProblem) -> None:
    beads = as_surface.fiducials_rest + np.array([0.0, 0.0, 0.004])
    with pytest.raises(InputError, match="fiducial 0 at"):
        mesh_experiment(replace(as_surface, fiducials_rest=beads), COARSE)


def test_a_box_off_the_surface_is_refused_by_name(as_surface: Experiment) -> None:
    away = Box((-0.0601, -0.0501, -0.0051), (-0.0599, 0.0501, 0.0051))
    with pytest.raises(InputError, match="anchor 2 holds no tissue"):
        mesh_experiment(replace(as_surface, anchors=(*as_surface.anchors, away)), COARSE)


def run_verb(*arguments: str | Path) -> Result:
    parser = argparse.ArgumentParser()
    add_parser(parser.add_subparsers())
    options = parser.parse_args(["mesh", *map(str, arguments)])
    result = options.run(options)
    assert isinstance(result, Result)
    return result


def test_the_verb_meshes_an_experiment_and_tells_the_quality(as_surface: Experiment, tmp_path: Path) -> None:
    assert as_surface.path is not None
    target = tmp_path / "pull.vtu"
    result = run_verb(as_surface.path, "--edge-length", "0.02", "-o", target)
    told = json.loads(json.dumps(result.data))
    assert told["mesh"]["kind"] == "tet10"
    assert set(told["quality"]["covered"]) == {"anchor 1", "grasp"}
    assert told["files"] == [str(target), str(tmp_path / "pull.png")]
    assert all(Path(file).stat().st_size > 1000 for file in told["files"])
    assert f"{told['mesh']['elements']} quadratic tetrahedra" in result.text
    assert "grasp" in result.text


@pytest.fixture
def in_millimetres(as_surface: Experiment, tmp_path: Path) -> Experiment:
    """The same experiment, its surface a PLY file in millimetres with one face twice."""
    block = block_surface((0.1, 0.1, 0.01))
    vertices, faces = (1e3 * block.vertices).tolist(), block.triangles.tolist()
    (tmp_path / "block.ply").write_bytes(ply_file(vertices, [*faces, faces[0]], "binary_little_endian"))
    phantom = Phantom("surface", (0.1, 0.1, 0.01), tmp_path / "block.ply")
    return write_experiment(replace(as_surface, phantom=phantom), tmp_path / "pull")


def test_an_experiment_with_a_ply_file_in_millimetres_poses_the_same_problem(
    in_millimetres: Experiment, problem: RetractionProblem
) -> None:
    assert in_millimetres.path is not None
    again = mesh_experiment(read_experiment(in_millimetres.path), COARSE)
    extent = np.ptp(again.body.mesh.points, axis=0)
    assert extent == pytest.approx(np.ptp(problem.body.mesh.points, axis=0), abs=1e-6)
    size, repeated = surface_notes(in_millimetres, COARSE)
    assert size.endswith("phantom.ply: taken as millimetres by its size: 100 mm long")
    assert repeated.endswith("phantom.ply: left out 1 triangles that stood twice")


def test_nothing_is_said_of_a_block_nor_of_a_surface_that_was_taken_as_it_is(
    as_surface: Experiment, problem: RetractionProblem
) -> None:
    assert surface_notes(block_experiment()) == []
    assert surface_notes(as_surface, COARSE) == []


def test_the_verb_says_what_was_repaired_and_refuses_it_where_it_shall_be_strict(
    in_millimetres: Experiment, tmp_path: Path
) -> None:
    file = tmp_path / "block.ply"
    result = run_verb(file, "--edge-length", "0.05", "-o", tmp_path / "a.vtu")
    said = ["taken as millimetres by its size: 100 mm long", "left out 1 triangles that stood twice"]
    assert result.data["repairs"] == said
    assert result.data["warnings"] == []
    assert all(f"repaired         {repair}" in result.text for repair in said)
    with pytest.raises(
        InputError, match=r"block\.ply: taken as millimetres.*stood twice; mend it .*--strict"
    ):
        run_verb(file, "--strict", "-o", tmp_path / "b.vtu")
    with pytest.raises(InputError, match=r"block\.ply: left out 1 triangles that stood twice; mend it"):
        run_verb(file, "--unit", "mm", "--strict", "-o", tmp_path / "b.vtu")
    assert not (tmp_path / "b.vtu").exists()


def test_the_unit_of_an_experiment_is_stated_in_its_file(as_surface: Experiment) -> None:
    assert as_surface.path is not None
    with pytest.raises(InputError, match=r'write unit = "cm" under \[phantom\]'):
        run_verb(as_surface.path, "--unit", "cm")


def test_the_verb_refuses_a_block_and_a_name_that_is_no_vtu(as_surface: Experiment, tmp_path: Path) -> None:
    block = write_experiment(block_experiment(), tmp_path / "block")
    assert block.path is not None
    with pytest.raises(InputError, match="its phantom is a block"):
        run_verb(block.path)
    with pytest.raises(InputError, match=r"out\.stl: meshes are written as \.vtu, \.msh, \.inp, \.feb"):
        run_verb(as_surface.phantom.surface or "", "-o", "out.stl")
