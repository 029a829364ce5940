"""The surface of a mesh: which faces, which way they look, and the area that they make."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.fem.discretisation.block_mesh import structured_mesh
from estimator.fem.discretisation.elements import ElementKind, reference_element
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces, facets, outlines

FloatArray = NDArray[np.float64]
EDGES = [np.array([0.0, 2.0, 3.0]), np.array([0.0, 1.0]), np.array([0.0, 0.5])]
HEXAHEDRA: list[ElementKind] = ["hex8", "hex27", "hex64"]
TETRAHEDRA: list[ElementKind] = ["tet4", "tet10"]


def one_element(kind: ElementKind) -> Mesh:
    nodes = reference_element(kind).nodes
    return Mesh(nodes.copy(), np.arange(len(nodes))[None], kind)


def two_tetrahedra() -> Mesh:
    """Two tetrahedra on either side of the triangle between x, y and z."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    return Mesh(points, np.array([[0, 1, 2, 3], [4, 1, 3, 2]]), "tet4")


def area_vectors(points: FloatArray, polygons: NDArray[np.int64]) -> FloatArray:
    """Area times outward normal of flat polygons, by a fan of triangles."""
    corners = points[polygons]
    fan = np.cross(corners[:, 1:-1] - corners[:, :1], corners[:, 2:] - corners[:, :1])
    return fan.sum(axis=1) / 2


def enclosed_volume(points: FloatArray, polygons: NDArray[np.int64]) -> float:
    """Volume by the divergence theorem: positive where normals look outwards."""
    centres = points[polygons].mean(axis=1)
    return float(np.einsum("fx,fx->", centres, area_vectors(points, polygons)) / 3)


@pytest.mark.parametrize(
    ("kind", "volume"), [*((k, 8.0) for k in HEXAHEDRA), *((k, 1 / 6) for k in TETRAHEDRA)]
)
def test_all_faces_of_one_element_are_on_its_surface_and_look_outwards(
    kind: ElementKind, volume: float
) -> None:
    mesh = one_element(kind)
    polygons = facets(boundary_faces(mesh))
    centre = mesh.points.mean(axis=0)
    outwards = np.einsum(
        "fx,fx->f", mesh.points[polygons].mean(axis=1) - centre, area_vectors(mesh.points, polygons)
    )
    assert np.all(outwards > 0)
    assert enclosed_volume(mesh.points, polygons) == pytest.approx(volume)


@pytest.mark.parametrize("kind", HEXAHEDRA)
def test_the_face_between_two_hexahedra_is_no_surface(kind: ElementKind) -> None:
    mesh = structured_mesh(EDGES, kind)
    faces = boundary_faces(mesh)
    assert len(faces) == 10
    at_interface = np.all(mesh.points[faces][:, :, 0] == 2.0, axis=1)
    assert not at_interface.any()
    assert enclosed_volume(mesh.points, facets(faces)) == pytest.approx(1.5)


def test_the_face_between_two_tetrahedra_is_no_surface() -> None:
    mesh = two_tetrahedra()
    faces = boundary_faces(mesh)
    assert {frozenset(face) for face in faces.tolist()} == {
        frozenset(face) for face in [(0, 1, 2), (0, 1, 3), (0, 2, 3), (4, 1, 2), (4, 1, 3), (4, 2, 3)]
    }
    assert enclosed_volume(mesh.points, facets(faces)) == pytest.approx(1 / 6 + 1 / 3)


@pytest.mark.parametrize(
    ("kind", "pieces"), [("hex8", 1), ("hex27", 4), ("hex64", 9), ("tet4", 1), ("tet10", 4)]
)
def test_a_face_is_split_between_its_nodes(kind: ElementKind, pieces: int) -> None:
    mesh = one_element(kind)
    faces = boundary_faces(mesh)
    polygons = facets(faces)
    assert len(polygons) == pieces * len(faces)
    areas = np.linalg.norm(area_vectors(mesh.points, polygons), axis=1).reshape(len(faces), pieces)
    assert areas == pytest.approx(np.repeat(areas[:, :1], pieces, axis=1))


@pytest.mark.parametrize("kind", [*HEXAHEDRA, *TETRAHEDRA])
def test_an_outline_runs_once_around_its_face(kind: ElementKind) -> None:
    mesh = one_element(kind)
    faces = boundary_faces(mesh)
    rims = outlines(faces)
    assert np.array_equal(rims[:, 0], rims[:, -1])
    assert all(len(set(rim)) == len(rim) - 1 for rim in rims.tolist())
    polygons = facets(faces)
    of_faces = area_vectors(mesh.points, polygons).reshape(len(faces), -1, 3).sum(axis=1)
    assert area_vectors(mesh.points, rims[:, :-1]) == pytest.approx(of_faces)
