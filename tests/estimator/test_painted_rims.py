"""The rim of a painted patch follows what was painted, not triangles, and a mesh follows the rim."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces
from estimator.geometry.grading import EdgeLengths
from estimator.geometry.holds import Hold, hold_regions
from estimator.geometry.imprint import rim
from estimator.geometry.painted import Painted, painted_patch
from estimator.geometry.quality import triangle_areas
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.geometry.tetrahedralise import TissueMesh, halved, tetrahedralise
from estimator.surfaces.formats.painting import Painting
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

RADIUS_M = 0.05
BALL = sphere_surface(RADIUS_M, 4)
# of the triangles of the sphere, m
SPACING_M = 3.4e-3
NORMALS = ([0.0, 0.0, 1.0], [0.48, 0.6, 0.64], [-0.9, 0.1, np.sqrt(0.18)])


def cap(normal: FloatArray | list[float], height_m: float, *, by_face: bool = False) -> Painted:
    """What is painted of the ball beyond a plane."""
    points = BALL.corners.mean(axis=1) if by_face else BALL.vertices
    painting = Painting(points, (points @ normal > height_m).astype(float))
    return painted_patch(BALL, lambda positions: painting.nearest_has(1.0, positions), SPACING_M)


def held(surface: Surface, patch: Painted) -> tuple[Surface, Hold]:
    body = hold_regions(surface, {"anchor": patch}, 0.01)
    return body.surface, body.holds["anchor"]


def off_plane(points: FloatArray, normal: list[float], height_m: float) -> FloatArray:
    return np.asarray(points.reshape(-1, 3) @ normal - height_m)


@pytest.mark.parametrize("by_face", [False, True])
@pytest.mark.parametrize("normal", NORMALS)
def test_a_round_rim_that_triangles_approximate_by_steps_is_round_again(
    normal: list[float], by_face: bool
) -> None:
    height = 0.02
    surface, hold = held(BALL, cap(normal, height, by_face=by_face))
    edges = surface.vertices[rim(surface, hold.patch)]
    assert np.sqrt(np.mean(off_plane(edges, normal, height) ** 2)) < 0.25 * SPACING_M
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum()
    assert length == pytest.approx(2 * np.pi * np.sqrt(RADIUS_M**2 - height**2), rel=0.03)


@pytest.mark.parametrize("height", [0.0, 0.03, 0.045])
def test_a_patch_has_the_area_that_is_painted(height: float) -> None:
    _, hold = held(BALL, cap(NORMALS[1], height))
    assert hold.area_m2 == pytest.approx(2 * np.pi * RADIUS_M * (RADIUS_M - height), rel=0.03)


def test_a_spot_of_one_point_is_not_lost() -> None:
    top = BALL.vertices @ [0.0, 0.0, 1.0]
    painting = Painting(BALL.vertices, (top == top.max()).astype(float))
    _, hold = held(BALL, painted_patch(BALL, lambda x: painting.nearest_has(1.0, x), SPACING_M))
    assert 0.5 * SPACING_M**2 < hold.area_m2 < 1.5 * SPACING_M**2


def test_a_painting_on_other_triangles_gives_the_same_patch() -> None:
    other = sphere_surface(RADIUS_M, 5)
    turned = other.vertices @ np.linalg.qr(np.array([[1.0, 2.0, 0.5], [0.3, 1.0, 2.0], [2.0, 0.1, 1.0]]))[0]
    painting = Painting(turned, (turned @ NORMALS[1] > 0.02).astype(float))
    patch = painted_patch(BALL, lambda x: painting.nearest_has(1.0, x), SPACING_M / 2)
    (surface, one), (_, own) = held(BALL, patch), held(BALL, cap(NORMALS[1], 0.02))
    assert one.area_m2 == pytest.approx(own.area_m2, rel=0.02)
    off = off_plane(surface.vertices[rim(surface, one.patch)], NORMALS[1], 0.02)
    assert np.abs(off).max() < 0.5 * SPACING_M


@pytest.mark.parametrize("cells", [(1, 1, 1), (8, 5, 3), (16, 10, 6)])
@pytest.mark.parametrize("by_face", [False, True])
def test_a_rim_along_an_edge_of_the_body_stays_there(cells: tuple[int, int, int], by_face: bool) -> None:
    size = (0.08, 0.05, 0.03)
    block = block_surface(size, cells)
    points = block.corners.mean(axis=1) if by_face else block.vertices
    painting = Painting(points, (points[:, 0] > 0.0399).astype(float))

    def at_end(positions: FloatArray) -> NDArray[np.bool_]:
        """As a painted patch has it, no farther than a little beyond what is painted."""
        return np.asarray(painting.nearest_has(1.0, positions) & (positions[:, 0] > 0.039))

    surface, hold = held(block, painted_patch(block, at_end, size[0] / cells[0]))
    assert hold.area_m2 == pytest.approx(size[1] * size[2])
    assert surface.corners[hold.patch][:, :, 0] == pytest.approx(size[0] / 2)


@pytest.mark.parametrize(("height", "what"), [(0.06, "no tissue"), (-0.06, "all of the tissue")])
def test_a_painting_that_holds_nothing_or_everything_is_refused(height: float, what: str) -> None:
    with pytest.raises(InputError, match=f"^anchor holds {what}; paint it on this surface, in its frame"):
        held(BALL, cap(NORMALS[0], height))


@pytest.fixture(scope="module")
def meshes() -> tuple[TissueMesh, TissueMesh]:
    """A ball held at a cap, and the same halved."""
    lengths = EdgeLengths(0.04, {"anchor": 0.02}, growth=1.0)
    regions = {"anchor": cap(NORMALS[1], 0.02)}
    tissue = tetrahedralise(BALL, regions, lengths)
    return tissue, halved(tissue, BALL, regions, lengths)


@pytest.mark.parametrize("which", [0, 1])
def test_the_rim_of_a_mesh_lies_on_the_rim_of_the_paint(
    meshes: tuple[TissueMesh, TissueMesh], which: int
) -> None:
    tissue = meshes[which]
    points, nodes = tissue.mesh.points, tissue.held["anchor"]
    faces = boundary_faces(Mesh(points, tissue.mesh.cells[:, :4], "tet4"))
    on_rim = np.intersect1d(faces[nodes[faces].all(axis=1)], faces[~nodes[faces].all(axis=1)])
    off = off_plane(points[on_rim], NORMALS[1], 0.02)
    assert np.abs(off).max() < SPACING_M


@pytest.mark.parametrize("which", [0, 1])
def test_held_nodes_span_little_skin_that_is_free(meshes: tuple[TissueMesh, TissueMesh], which: int) -> None:
    tissue = meshes[which]
    points, nodes = tissue.mesh.points, tissue.held["anchor"]
    faces = boundary_faces(tissue.mesh)
    spanned = triangle_areas(points[faces[nodes[faces[:, :3]].all(axis=1), :3]]).sum()
    own = triangle_areas(points[faces[nodes[faces].all(axis=1), :3]]).sum()
    assert spanned < 1.01 * own


@pytest.mark.parametrize("which", [0, 1])
def test_what_a_mesh_covers_is_told_of_the_curved_skin_not_of_its_chords(
    meshes: tuple[TissueMesh, TissueMesh], which: int
) -> None:
    assert meshes[which].quality.covered["anchor"] == pytest.approx(1.0, abs=0.01)
