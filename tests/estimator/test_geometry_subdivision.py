"""Every tetrahedron of a mesh is cut into eight, and the new skin follows the surface closer."""

from collections.abc import Iterator

import numpy as np
import pytest
from organ_cases import ball

from estimator.experiment import Box
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces
from estimator.geometry.grading import EdgeLengths
from estimator.geometry.holds import hold_regions
from estimator.geometry.mesh_cache import halved_mesh, tissue_mesh
from estimator.geometry.quality import tetrahedron_volumes, triangle_areas
from estimator.geometry.subdivision import halved_cells
from estimator.geometry.tetrahedralise import TissueMesh

BALL = ball((0.0, 0.0, 0.0), 0.02)
HELD = {"grasp": Box((0.012, -0.03, -0.03), (0.03, 0.03, 0.03))}
LENGTHS = EdgeLengths(0.012, {"grasp": 0.008})


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TissueMesh, TissueMesh]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RETRACT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield tissue_mesh(BALL, HELD, LENGTHS), halved_mesh(BALL, HELD, LENGTHS)


def test_the_parts_of_a_mesh_fill_it_and_meet(meshes: tuple[TissueMesh, TissueMesh]) -> None:
    mesh = meshes[0].mesh
    parts = halved_cells(mesh.points, mesh.cells)
    whole = tetrahedron_volumes(mesh.points[mesh.cells[:, :4]])
    volumes = tetrahedron_volumes(mesh.points[parts])
    assert len(parts) == 8 * len(mesh.cells)
    assert volumes.min() > 0.12 * whole.min()
    assert volumes.sum() == pytest.approx(whole.sum())
    skin = boundary_faces(Mesh(mesh.points, mesh.cells[:, :4], "tet4"))
    assert len(boundary_faces(Mesh(mesh.points, parts, "tet4"))) == 4 * len(skin)


@pytest.mark.parametrize("turn", [[0, 1, 2, 3], [1, 2, 0, 3], [2, 0, 1, 3], [3, 2, 1, 0]])
def test_whichever_diagonal_is_the_shortest_the_parts_are_not_turned_over(turn: list[int]) -> None:
    long = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0.2, 0.3, 3)])[turn]
    middles = [(long[a] + long[b]) / 2 for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
    points = np.vstack([long, middles])
    parts = tetrahedron_volumes(points[halved_cells(points, np.arange(10)[None])])
    assert parts == pytest.approx(np.full(8, tetrahedron_volumes(long[None])[0] / 8))
    assert parts.min() > 0


def test_a_halved_mesh_follows_the_surface_closer(meshes: tuple[TissueMesh, TissueMesh]) -> None:
    coarse, fine = meshes
    assert len(fine.mesh.cells) == 8 * len(coarse.mesh.cells)
    assert abs(fine.quality.volume_error) < 0.6 * abs(coarse.quality.volume_error)
    assert fine.held["grasp"].sum() > 2.5 * coarse.held["grasp"].sum()


@pytest.mark.parametrize("which", [0, 1])
def test_a_wall_is_covered_though_its_faces_are_chords(
    meshes: tuple[TissueMesh, TissueMesh], which: int
) -> None:
    tissue = meshes[which]
    faces = boundary_faces(tissue.mesh)
    held = faces[tissue.held["grasp"][faces].all(axis=1), :3]
    wall_m2 = hold_regions(BALL, HELD, LENGTHS.largest_m).holds["grasp"].area_m2
    of_chords = triangle_areas(tissue.mesh.points[held]).sum() / wall_m2
    assert tissue.quality.covered["grasp"] == pytest.approx(1.0, abs=0.01)
    assert abs(tissue.quality.covered["grasp"] - 1.0) < 0.5 * abs(of_chords - 1.0)


def test_the_corners_of_a_halved_mesh_are_the_nodes_of_the_mesh(
    meshes: tuple[TissueMesh, TissueMesh],
) -> None:
    coarse, fine = (one.mesh for one in meshes)
    count = len(coarse.points)
    moved = np.linalg.norm(fine.points[:count] - coarse.points, axis=1)
    skin = np.unique(boundary_faces(Mesh(coarse.points, coarse.cells, "tet10")))
    inner = np.setdiff1d(np.arange(count), skin)
    assert len(inner)
    assert np.all(moved[inner] == 0.0)
    assert moved.max() < 0.2 * LENGTHS.largest_m


def test_it_is_the_same_every_time(meshes: tuple[TissueMesh, TissueMesh]) -> None:
    again = halved_mesh(BALL, HELD, LENGTHS)
    assert np.array_equal(again.mesh.points, meshes[1].mesh.points)
    assert np.array_equal(again.mesh.cells, meshes[1].mesh.cells)
