"""Meshes of surfaces: volumes, held areas, element quality, the patch test, and that a mesh once made is kept."""

import base64
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import Box
from estimator.fem.assembly.body import build_body, nodal_forces, respond
from estimator.fem.discretisation.elements import reference_element
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces
from estimator.geometry import mesh_cache
from estimator.geometry.bisection import refine
from estimator.geometry.grading import EdgeLengths
from estimator.geometry.painted import Painted
from estimator.geometry.quality import MeshQuality, check_quality, quality_warnings, tetrahedron_volumes
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.geometry.tetrahedralise import TissueMesh, tetrahedralise
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.meshes.writing import volume_mesh_of, write_mesh
from estimator.report.drawing.mesh_picture import draw_mesh
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

REGIONS = {
    "anchor": Box((-0.0501, -0.0501, -0.0051), (-0.0499, 0.0501, 0.0051)),
    "glue": Box((-0.02, 0.01, 0.0049), (0.0, 0.04, 0.0051)),
    "grasp": Box((0.03, -0.01, -0.0051), (0.05, 0.01, 0.0051)),
}


@pytest.fixture(scope="module")
def block() -> TissueMesh:
    lengths = EdgeLengths(0.016, {"grasp": 0.005}, growth=1.0)
    return tetrahedralise(block_surface((0.1, 0.1, 0.01)), REGIONS, lengths)


@pytest.fixture(scope="module")
def sphere() -> TissueMesh:
    surface = sphere_surface(0.05, 3)
    # along triangles: above zero where all of those around a vertex are held, zero where some are
    low = surface.corners[:, :, 2].max(axis=1) < -0.035
    inner, outer = (
        np.isin(np.arange(len(surface.vertices)), surface.triangles[~which]) for which in (low, ~low)
    )
    foot = Painted(np.where(inner & outer, 0.0, np.where(inner, -1.0, 1.0)))
    return tetrahedralise(surface, {"foot": foot}, EdgeLengths(0.04, {"foot": 0.02}, growth=1.0))


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RETRACT_CACHE", str(tmp_path))
    return mesh_cache.cache_folder()


def held_faces(tissue: TissueMesh, name: str) -> FloatArray:
    """Corners of the element faces that a region holds, (f, 3, 3)."""
    faces = boundary_faces(tissue.mesh)
    return tissue.mesh.points[faces[tissue.held[name][faces].all(axis=1)][:, :3]]


def areas(triangles: FloatArray) -> FloatArray:
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_a_block_has_its_volume_less_the_gripped_column(block: TissueMesh) -> None:
    assert len(block.mesh.cells) < 1500
    assert build_body(block.mesh).volume.sum() == pytest.approx(1e-4 - 4e-6, rel=2e-3)
    assert abs(block.quality.volume_error) < 2e-3


def test_a_sphere_has_its_volume(sphere: TissueMesh) -> None:
    assert len(sphere.mesh.cells) < 1500
    # Triangles lose 0.9 % to the sphere, chords of this length another 1.5 %.
    assert build_body(sphere.mesh).volume.sum() == pytest.approx(4 / 3 * np.pi * 0.05**3, rel=0.03)


@pytest.mark.parametrize(
    ("name", "area"), [("anchor", 0.1 * 0.01), ("glue", 0.02 * 0.03), ("grasp", 3 * 0.02 * 0.01)]
)
def test_a_held_region_of_a_block_is_covered(block: TissueMesh, name: str, area: float) -> None:
    assert areas(held_faces(block, name)).sum() == pytest.approx(area, rel=0.01)
    assert block.quality.covered[name] == pytest.approx(1.0, abs=0.01)


def test_held_nodes_lie_in_their_region_and_all_others_out_of_it(block: TissueMesh) -> None:
    for name, box in REGIONS.items():
        points, held = block.mesh.points, block.held[name]
        lower, upper = np.array(box.lower), np.array(box.upper)
        off = np.linalg.norm(np.maximum(np.maximum(lower - points, points - upper), 0.0), axis=1)
        assert off[held].max() < 2e-4
        depth = np.minimum(points - lower, upper - points).min(axis=1)
        assert depth[~held].max() < 2e-4


def test_a_painted_patch_is_covered(sphere: TissueMesh) -> None:
    assert sphere.quality.covered["foot"] == pytest.approx(1.0, abs=0.02)
    assert held_faces(sphere, "foot")[:, :, 2].max() < -0.034


def test_no_element_is_much_longer_than_the_grading_wants(block: TissueMesh) -> None:
    corners = block.mesh.points[block.mesh.cells[:, :4]]
    first, second = np.triu_indices(4, 1)
    length = np.linalg.norm(corners[:, first] - corners[:, second], axis=2)
    middle = (corners[:, first] + corners[:, second]) / 2
    from_grasp = np.min([np.linalg.norm(middle[:, :, :2] - [0.03, y], axis=2) for y in (-0.01, 0.01)], axis=0)
    longest = np.argmax(length, axis=1)[:, None]
    length, from_grasp = (np.take_along_axis(x, longest, axis=1) for x in (length, from_grasp))
    assert np.all(length < 1.05 * np.sqrt(2) * (0.005 + from_grasp))
    assert length.max() > 0.015


def test_quality_is_told_as_it_is(block: TissueMesh, sphere: TissueMesh) -> None:
    for tissue in (block, sphere):
        low, high = tissue.quality.dihedral_deg
        assert 5.0 < low < 70.5 < high < 175.0
        worst, mean = tissue.quality.radius_ratio
        assert 0.02 < worst < mean < 1.0
    assert block.quality.off_surface_m < 5e-4
    assert sphere.quality.off_surface_m < 2e-3


@pytest.mark.parametrize("poisson_ratio", [0.3, 0.49])
def test_a_uniform_deformation_is_in_equilibrium(block: TissueMesh, poisson_ratio: float) -> None:
    body = build_body(block.mesh)
    gradient = np.array([[0.2, 0.1, 0.0], [-0.05, -0.1, 0.1], [0.15, 0.0, 0.05]])
    displacement = block.mesh.points @ gradient.T
    response = respond(body, Material(NeoHookean(), 15e3, poisson_ratio), displacement)
    assert np.broadcast_to(np.eye(3) + gradient, response.F.shape) == pytest.approx(response.F, abs=1e-9)
    forces = np.linalg.norm(nodal_forces(body, response, response.slope), axis=1)
    outer = np.zeros(len(forces), dtype=bool)
    outer[boundary_faces(block.mesh)] = True
    assert np.count_nonzero(~outer) > 50
    assert forces[~outer].max() < 1e-9 * forces[outer].max()


def test_bisection_conforms_keeps_the_volume_and_reaches_the_wanted_length() -> None:
    points = reference_element("hex8").nodes * 0.05
    cells = np.array([[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]])

    def wanted(x: FloatArray) -> FloatArray:
        return 0.01 + 0.5 * np.linalg.norm(x - 0.05, axis=1)

    assert np.all(tetrahedron_volumes(points[cells]) > 0)
    fine, children = refine(points, cells, wanted)
    volumes = tetrahedron_volumes(fine[children])
    assert np.all(volumes > 0)
    assert volumes.sum() == pytest.approx(0.1**3)
    ends = fine[children[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]]]
    length = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=2)
    assert np.all(
        length.max(axis=1) <= np.sqrt(2) * 0.01 + 0.9 * np.linalg.norm(ends.mean(axis=(1, 2)) - 0.05, axis=1)
    )
    skin = boundary_faces(Mesh(fine, children, "tet4"))
    assert areas(fine[skin]).sum() == pytest.approx(6 * 0.1**2)


def test_a_bad_mesh_is_refused_with_every_fault() -> None:
    bad = MeshQuality(1e-4, -0.05, (1.0, 178.0), (0.001, 0.5), 1e-3, 4e-3, {"anchor 1": 1.0, "grasp": 0.6})
    with pytest.raises(InputError) as caught:
        check_quality(bad, 3e-4, block_surface((0.1, 0.1, 0.01)))
    message = str(caught.value)
    assert "volume is off by -5.0 %" in message
    assert "covers 60.0 % of grasp" in message
    assert "angle of 1.0 degrees" in message
    assert "lie 4.00 mm apart at most, and the mesher is allowed 0.30 mm" in message
    assert "anchor 1" not in message


def good(off_surface_m: float, missed_m: float) -> MeshQuality:
    return MeshQuality(1e-4, 0.0, (20.0, 140.0), (0.3, 0.7), off_surface_m, missed_m, {"grasp": 1.0})


@pytest.mark.parametrize("both_ways", [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
@pytest.mark.parametrize(
    ("envelopes", "outcome"), [(2.2, "good"), (2.8, "doubtful"), (5.5, "doubtful"), (6.5, "bad")]
)
def test_the_distance_of_mesh_and_surface_is_judged_both_ways(
    envelopes: float, outcome: str, both_ways: tuple[float, float]
) -> None:
    quality = good(*(3e-4 * envelopes * share for share in both_ways))
    surface = block_surface((0.1, 0.1, 0.01))
    if outcome == "bad":
        with pytest.raises(InputError, match=r"the mesher is allowed 0\.30 mm"):
            check_quality(quality, 3e-4, surface)
    else:
        check_quality(quality, 3e-4, surface)
        assert bool(quality_warnings(quality, 3e-4, surface)) == (outcome == "doubtful")


def dented(depth_m: float) -> Surface:
    """A ball with a dent of 12 mm width from above, which goes out below where it is deeper than the ball."""
    ball = sphere_surface(0.03, 2)
    x, y, z = ball.vertices.T
    dent = depth_m * np.exp(-(x**2 + y**2) / 0.006**2) * (z > 0)
    return closed_surface(np.column_stack([x, y, z - dent]), ball.triangles, "ball")


@pytest.mark.parametrize(("depth_m", "crosses"), [(0.02, False), (0.068, True)])
def test_a_mesh_that_leaves_a_surface_which_crosses_itself_is_refused_with_the_cause(
    depth_m: float, crosses: bool
) -> None:
    if crosses:
        with pytest.raises(InputError, match=r"apart at most.*the surface crosses itself, first near"):
            tetrahedralise(dented(depth_m), {}, EdgeLengths(0.016))
    else:
        quality = tetrahedralise(dented(depth_m), {}, EdgeLengths(0.016)).quality
        assert quality.deviation_m < 0.025 * 0.016


def test_a_cavity_is_left_empty_in_the_mesh() -> None:
    outer, inner = sphere_surface(0.05, 3), sphere_surface(0.02, 3)
    corners = np.concatenate([outer.corners, inner.corners + np.array([0.01, 0.0, 0.0])])
    hollow = closed_surface(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), "hollow")
    tissue = tetrahedralise(hollow, {}, EdgeLengths(0.025))
    assert tissue.quality.volume_m3 == pytest.approx(outer.volume_m3 - inner.volume_m3, rel=0.02)
    centres = tissue.mesh.points[tissue.mesh.cells[:, :4]].mean(axis=1)
    assert np.linalg.norm(centres - [0.01, 0.0, 0.0], axis=1).min() > 0.019


def test_a_kept_mesh_that_was_not_judged_is_judged_when_it_is_found(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    far_off = replace(one_tetrahedron(1.0), quality=good(0.0, 0.01))
    monkeypatch.setattr(mesh_cache, "tetrahedralise", lambda *_: far_off)
    for _ in range(2):
        with pytest.raises(InputError, match=r"10\.00 mm apart"):
            mesh_cache.tissue_mesh(block_surface((0.1, 0.1, 0.01)), REGIONS, EdgeLengths(0.01))


@pytest.mark.parametrize(
    ("edge_length", "complaint"), [(-0.01, "above 0"), (1.0, "below"), (1e-5, "1e\\+06")]
)
def test_an_edge_length_out_of_proportion_is_refused(edge_length: float, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        tetrahedralise(block_surface((0.1, 0.1, 0.01)), {}, EdgeLengths(edge_length))


def one_tetrahedron(height: float) -> TissueMesh:
    points = reference_element("tet10").nodes * [1.0, 1.0, height]
    mesh = Mesh(points, np.arange(10)[None], "tet10")
    quality = MeshQuality(height / 6, 0.0, (54.7, 90.0), (0.7, 0.7), 0.0, 0.0, {"grasp": 1.0})
    held = {"grasp": points[:, 2] == 0.0}
    return TissueMesh(mesh, held, {"grasp": Box((0.0, 0.0, -1.0), (1.0, 1.0, 0.0))}, quality)


def test_a_mesh_that_was_made_is_found_again(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    heights: Iterator[float] = iter([1.0, 2.0])
    monkeypatch.setattr(mesh_cache, "tetrahedralise", lambda *_: one_tetrahedron(next(heights)))
    surface, lengths = block_surface((0.1, 0.1, 0.01)), EdgeLengths(0.01, {"grasp": 0.005})
    first = mesh_cache.tissue_mesh(surface, REGIONS, lengths)
    again = mesh_cache.tissue_mesh(surface, REGIONS, lengths)
    assert np.array_equal(again.mesh.points, one_tetrahedron(1.0).mesh.points)
    assert np.array_equal(again.held["grasp"], first.held["grasp"])
    assert again.quality == first.quality == one_tetrahedron(1.0).quality
    assert again.rigid == one_tetrahedron(1.0).rigid
    other = mesh_cache.tissue_mesh(surface, REGIONS, EdgeLengths(0.01, {"grasp": 0.004}))
    assert np.array_equal(other.mesh.points, one_tetrahedron(2.0).mesh.points)
    assert len(list(cache.iterdir())) == 2


def test_of_two_that_make_one_mesh_at_once_the_first_prevails(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    surface, lengths = block_surface((0.1, 0.1, 0.01)), EdgeLengths(0.01)

    def overtaken(*_: object) -> TissueMesh:
        monkeypatch.setattr(mesh_cache, "tetrahedralise", lambda *_: one_tetrahedron(1.0))
        mesh_cache.tissue_mesh(surface, REGIONS, lengths)
        return one_tetrahedron(2.0)

    monkeypatch.setattr(mesh_cache, "tetrahedralise", overtaken)
    late = mesh_cache.tissue_mesh(surface, REGIONS, lengths)
    assert np.array_equal(late.mesh.points, one_tetrahedron(1.0).mesh.points)
    assert len(list(cache.iterdir())) == 1


def test_a_damaged_kept_mesh_is_named(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_cache, "tetrahedralise", lambda *_: one_tetrahedron(1.0))
    surface = block_surface((0.1, 0.1, 0.01))
    mesh_cache.tissue_mesh(surface, REGIONS, EdgeLengths(0.01))
    (file,) = cache.iterdir()
    file.write_bytes(file.read_bytes()[:300])
    with pytest.raises(
        InputError, match=f"^{re.escape(str(file))}: the kept mesh is damaged; remove the file"
    ):
        mesh_cache.tissue_mesh(surface, REGIONS, EdgeLengths(0.01))


@pytest.mark.parametrize(("kind", "cell_type"), [("tet4", 10), ("tet10", 24)])
def test_a_vtu_file_holds_points_cells_and_held_nodes(
    tmp_path: Path, block: TissueMesh, kind: str, cell_type: int
) -> None:
    mesh = block.mesh if kind == "tet10" else Mesh(block.mesh.points, block.mesh.cells[:, :4].copy(), "tet4")
    write_mesh(volume_mesh_of(mesh, block.held), tmp_path / "block.vtu")
    piece = ElementTree.parse(tmp_path / "block.vtu").find("./UnstructuredGrid/Piece")
    assert piece is not None
    assert piece.attrib == {"NumberOfPoints": str(len(mesh.points)), "NumberOfCells": str(len(mesh.cells))}
    arrays = {array.attrib["Name"]: array for array in piece.iter("DataArray")}
    assert set(arrays) == {"anchor", "glue", "grasp", "Points", "connectivity", "offsets", "types"}
    read = {name: decoded(array) for name, array in arrays.items()}
    assert np.array_equal(read["Points"].reshape(-1, 3), mesh.points)
    assert np.array_equal(read["connectivity"].reshape(mesh.cells.shape), mesh.cells)
    assert np.array_equal(read["offsets"], np.arange(1, len(mesh.cells) + 1) * mesh.cells.shape[1])
    assert set(read["types"].tolist()) == {cell_type}
    assert np.array_equal(read["grasp"].astype(bool), block.held["grasp"])


def decoded(array: ElementTree.Element) -> NDArray[np.generic]:
    """The content of an inline binary array: its size in bytes as UInt64, then its bytes, little-endian."""
    content = base64.b64decode(array.text or "")
    assert int.from_bytes(content[:8], "little") == len(content) - 8
    return np.frombuffer(content[8:], np.dtype(array.attrib["type"].lower()).newbyteorder("<"))


def test_a_mesh_of_hexahedra_is_not_written_as_vtu(tmp_path: Path) -> None:
    mesh = Mesh(reference_element("hex8").nodes, np.arange(8)[None], "hex8")
    with pytest.raises(InputError, match="a mesh of hex8 cannot be written"):
        write_mesh(volume_mesh_of(mesh, {}), tmp_path / "hex.vtu")


def test_a_picture_is_a_png(tmp_path: Path, block: TissueMesh) -> None:
    draw_mesh(block.mesh, block.held, tmp_path / "block.png")
    content = (tmp_path / "block.png").read_bytes()
    assert content.startswith(b"\x89PNG\r\n\x1a\n")
    assert len(content) > 20_000
