"""Every element kind on a distorted mesh: patch test, rigid motion, force and tangent as derivatives."""

from collections.abc import Callable
from dataclasses import replace

import felupe
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import SolverError
from estimator.fem.assembly.body import Body, build_body, nodal_forces, respond, stiffness
from estimator.fem.discretisation.block_mesh import structured_mesh
from estimator.fem.discretisation.elements import ElementKind, evaluate, reference_element
from estimator.fem.discretisation.mesh import Mesh, interpolation_rows
from estimator.fem.discretisation.quadrature import points_of_parts
from estimator.materials import LAWS, NeoHookean
from estimator.materials.law import Law
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

HEXAHEDRA: tuple[ElementKind, ...] = ("hex8", "hex27", "hex64")
KINDS: tuple[ElementKind, ...] = ("tet4", "tet10", *HEXAHEDRA)
SHAPES = {
    "neo_hookean": [],
    "mooney_rivlin": [0.3],
    "yeoh2": [0.2],
    "yeoh3": [-0.1, 0.05],
    "gent": [0.3],
    "arruda_boyce": [0.25],
    "veronda_westmann": [0.8, -0.4],
    "ogden1": [3.0],
    "ogden2": [2.5, -1.5, 0.3],
    "st_venant_kirchhoff": [],
}
# 40 % stretch, shear and a rotation of some 40°; det F = 0.98 keeps the energy of the bulk in play.
LARGE_DEFORMATION = Rotation.from_rotvec([0.3, -0.5, 0.4]).as_matrix() @ np.array(
    [[1.4, 0.2, -0.1], [0.0, 0.8, 0.15], [0.0, 0.0, 0.875]]
)


def cube_mesh(kind: ElementKind, cells_per_edge: int, distortion: float = 0.1) -> Mesh:
    """A unit cube whose element corners are moved by a share of the element size; edges stay straight."""
    lines = [np.linspace(0.0, 1.0, cells_per_edge + 1)] * 3
    corners = structured_mesh(lines, "hex8")
    noise = np.random.default_rng(3).uniform(-1.0, 1.0, corners.points.shape)
    points = corners.points + distortion / cells_per_edge * noise
    if kind in HEXAHEDRA:
        mesh = structured_mesh(lines, kind)
        shape, _ = evaluate("hex8", reference_element(kind).nodes)
        moved = mesh.points.copy()
        moved[mesh.cells] = np.einsum("nk,ekx->enx", shape, points[corners.cells])
        return Mesh(moved, mesh.cells, kind)
    vtk_order = [0, 4, 6, 2, 1, 5, 7, 3]
    split = felupe.Mesh(points, corners.cells[:, vtk_order], "hexahedron").triangulate()
    if kind == "tet10":
        split = split.add_midpoints_edges()
    return Mesh(split.points, split.cells, kind)


def material(law: Law = LAWS["neo_hookean"], poisson_ratio: float = 0.45) -> Material:
    return Material(law, 2.0, poisson_ratio, np.array(SHAPES[law.name]))


def unprojected(body: Body) -> Body:
    return replace(body, basis=np.zeros((*body.volume.shape, 0)))


def homogeneous(mesh: Mesh, F: FloatArray) -> FloatArray:
    return mesh.points @ (F - np.eye(3)).T


def on_surface(mesh: Mesh, cells_per_edge: int) -> NDArray[np.bool_]:
    cube = cube_mesh(mesh.kind, cells_per_edge, distortion=0.0)
    return np.any(np.isclose(cube.points, 0.0) | np.isclose(cube.points, 1.0), axis=1)


def tangent_matrix(body: Body, law: Material, displacement: FloatArray) -> FloatArray:
    """The whole tangent (3n, 3n), dense."""
    response = respond(body, law, displacement)
    lower = np.tril(stiffness(body, law, response, response.pressure))
    elements = lower + np.tril(lower, -1).transpose(0, 2, 1)
    whole = np.zeros((displacement.size, displacement.size))
    for cell, element in zip(body.mesh.cells, elements, strict=True):
        dofs = (3 * cell[:, None] + np.arange(3)).ravel()
        whole[np.ix_(dofs, dofs)] += element
    return whole


def forces(body: Body, law: Material, displacement: FloatArray) -> FloatArray:
    response = respond(body, law, displacement)
    return nodal_forces(body, response, response.slope)


@pytest.mark.parametrize("kind", KINDS)
def test_a_distorted_patch_takes_up_a_large_homogeneous_deformation_exactly(kind: ElementKind) -> None:
    """Its surface is moved; Newton's method finds the inner nodes, from a wrong start, where they belong."""
    body = build_body(cube_mesh(kind, 2))
    exact = homogeneous(body.mesh, LARGE_DEFORMATION)
    inner = np.repeat(~on_surface(body.mesh, 2), 3)
    assert 0 < inner.sum() < inner.size
    found = exact.copy().reshape(-1)
    found[inner] += np.random.default_rng(4).uniform(-5e-3, 5e-3, inner.sum())
    for _ in range(6):
        field = found.reshape(-1, 3)
        tangent = tangent_matrix(body, material(), field)[np.ix_(inner, inner)]
        found[inner] -= np.linalg.solve(tangent, forces(body, material(), field).reshape(-1)[inner])
    np.testing.assert_allclose(found.reshape(-1, 3), exact, atol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_the_stress_of_a_patch_is_that_of_the_law(kind: ElementKind) -> None:
    """P = dW/dF by hand: μ(F − F⁻ᵀ) + λ(J − 1) J F⁻ᵀ; the virial of the nodal forces is P times the volume."""
    body = build_body(cube_mesh(kind, 2))
    found = forces(body, material(), homogeneous(body.mesh, LARGE_DEFORMATION))
    mu, lame = material().lame
    F, J = LARGE_DEFORMATION, np.linalg.det(LARGE_DEFORMATION)
    inverse = np.linalg.inv(F).T
    stress = mu * (F - inverse) + lame * (J - 1) * J * inverse
    np.testing.assert_allclose(found.T @ body.mesh.points, stress * body.volume.sum(), atol=1e-13)
    np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_what_the_integration_points_stand_for_makes_up_the_body(kind: ElementKind) -> None:
    """The share of a part that lies below a plane weighs as much as the cube does there."""
    body = build_body(cube_mesh(kind, 2, distortion=0.0))
    points = points_of_parts(body.mesh)
    assert np.einsum("eq,eqx->x", body.volume, points.mean(axis=2)) == pytest.approx(np.full(3, 0.5))
    for height in (0.1, 0.3, 0.6):
        below = (points[..., 2] < height).mean(axis=2)
        assert np.sum(body.volume * below) == pytest.approx(height, abs=0.04)


@pytest.mark.parametrize("kind", KINDS)
def test_a_rigid_motion_costs_no_force_and_no_energy(kind: ElementKind) -> None:
    body = build_body(cube_mesh(kind, 2))
    turned = homogeneous(body.mesh, Rotation.from_rotvec([0.4, -1.2, 2.0]).as_matrix())
    response = respond(body, material(), turned + np.array([0.3, -0.1, 0.2]))
    assert response.energy == pytest.approx(0.0, abs=1e-14)
    np.testing.assert_allclose(nodal_forces(body, response, response.slope), 0.0, atol=1e-14)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
@pytest.mark.parametrize(
    ("kind", "projected"), [*((kind, False) for kind in KINDS), *((kind, True) for kind in HEXAHEDRA)]
)
def test_the_force_is_the_slope_of_the_energy_and_the_tangent_that_of_the_force(
    kind: ElementKind, law: Law, projected: bool
) -> None:
    body = build_body(cube_mesh(kind, 1))
    body = body if projected else unprojected(body)
    assert bool(body.basis.shape[2]) == projected
    rng = np.random.default_rng(5)
    count = len(body.mesh.points)
    field = homogeneous(body.mesh, LARGE_DEFORMATION) + rng.uniform(-0.02, 0.02, (count, 3))
    direction = rng.uniform(-1.0, 1.0, (count, 3))
    stuff, step = material(law, 0.49), 1e-4

    def central(function: Callable[[FloatArray], FloatArray]) -> FloatArray:
        ahead, behind = (function(field + sign * step * direction) for sign in (1, -1))
        further, back = (function(field + sign * 2 * step * direction) for sign in (1, -1))
        return (8 * (ahead - behind) - (further - back)) / (12 * step)

    slope = central(lambda u: respond(body, stuff, u).energy)
    assert slope == pytest.approx(np.vdot(forces(body, stuff, field), direction), rel=1e-8)
    curve = central(lambda u: forces(body, stuff, u)).reshape(-1)
    tangent = tangent_matrix(body, stuff, field)
    np.testing.assert_allclose(tangent @ direction.reshape(-1), curve, atol=1e-8 * float(np.abs(curve).max()))


@pytest.mark.parametrize(("kind", "functions"), [("hex8", 1), ("hex27", 4), ("hex64", 10)])
def test_the_pressure_takes_of_the_dilatation_what_its_polynomials_can_represent(
    kind: ElementKind, functions: int
) -> None:
    body = build_body(cube_mesh(kind, 2))
    field = 0.03 * np.random.default_rng(8).uniform(-1.0, 1.0, body.mesh.points.shape)
    response = respond(body, material(), field)
    dropped = np.linalg.det(response.F) - 1.0 - response.dilatation
    x, y, z = reference_element(kind).points.T
    polynomials = np.stack([x**0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z][:functions])
    np.testing.assert_allclose(np.einsum("rq,eq,eq->er", polynomials, body.volume, dropped), 0.0, atol=1e-16)
    kept = np.linalg.lstsq(polynomials.T, response.dilatation.T)[0]
    np.testing.assert_allclose(polynomials.T @ kept, response.dilatation.T, atol=1e-14)
    assert np.abs(dropped).max() > 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_a_material_point_is_found_in_a_distorted_mesh(kind: ElementKind) -> None:
    mesh = cube_mesh(kind, 2)
    points = np.random.default_rng(6).uniform(0.15, 0.85, (20, 3))
    nodes, weights = interpolation_rows(mesh, points, 1e-9)
    np.testing.assert_allclose(np.einsum("mk,mkx->mx", weights, mesh.points[nodes]), points, atol=1e-12)


def test_an_element_turned_inside_out_is_refused_at_rest_and_under_load() -> None:
    mesh = cube_mesh("tet4", 1)
    with pytest.raises(SolverError, match=r"element \d of the mesh has a negative volume"):
        build_body(Mesh(mesh.points, mesh.cells[:, [1, 0, 2, 3]], "tet4"))
    with pytest.raises(SolverError, match="inside out"):
        respond(
            build_body(mesh), Material(NeoHookean(), 2.0, 0.3), homogeneous(mesh, np.diag([1.0, 1.0, -1.0]))
        )
