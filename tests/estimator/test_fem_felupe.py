"""The same retraction by an independent package: FElupe, with the same law from its own parts."""

from dataclasses import dataclass, replace

import felupe
import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK, follow, turning_pull

from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import HeldNodes, RetractionProblem, retraction_problem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.elements import ElementKind, reference_element
from estimator.fem.discretisation.mesh import Mesh
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

MATERIAL = Material(NeoHookean(), 15e3, 0.45)
SMALL = Grading(grasp_m=10e-3, anchor_m=20e-3, largest_m=30e-3, growth=2.0, layers=1)
# 10 mm along +x, turning by 17° about an oblique axis: every component of the wrench is excited.
POSES = turning_pull(REFERENCE_BLOCK, 0.01, np.array([0.2, 0.1, 0.2]), 2)


@dataclass(frozen=True)
class FelupeElement:
    """What FElupe calls an element, its region and its cells."""

    element: type[felupe.Element]
    region: type[felupe.Region]
    cell_type: str


FELUPE: dict[ElementKind, FelupeElement] = {
    "tet4": FelupeElement(felupe.Tetra, felupe.RegionTetra, "tetra"),
    "tet10": FelupeElement(felupe.QuadraticTetra, felupe.RegionQuadraticTetra, "tetra10"),
    "hex8": FelupeElement(felupe.Hexahedron, felupe.RegionHexahedron, "hexahedron"),
    "hex27": FelupeElement(
        felupe.TriQuadraticHexahedron, felupe.RegionTriQuadraticHexahedron, "VTK_LAGRANGE_HEXAHEDRON"
    ),
}


def order_in_felupe(kind: ElementKind) -> NDArray[np.int64]:
    """Our number of each node of FElupe's element, by where the nodes lie."""
    ours = reference_element(kind).nodes
    theirs = FELUPE[kind].element().points
    distance = np.linalg.norm(theirs[:, None] - ours, axis=2)
    assert np.allclose(distance.min(axis=1), 0.0)
    return np.argmin(distance, axis=1)


def problem_on(kind: ElementKind) -> RetractionProblem:
    """The reference block on a coarse mesh; tetrahedra split its hexahedra."""
    if kind in ("hex8", "hex27"):
        return mesh_experiment(REFERENCE_BLOCK, SMALL, kind)
    blocks = mesh_experiment(REFERENCE_BLOCK, SMALL, "hex8").body.mesh
    split = felupe.Mesh(blocks.points, blocks.cells[:, order_in_felupe("hex8")], "hexahedron").triangulate()
    if kind == "tet10":
        split = split.add_midpoints_edges()
    x, y, _ = split.points.T
    return retraction_problem(
        Mesh(split.points, split.cells, kind),
        HeldNodes(np.isclose(x, -0.05), (x > 0.03 - 1e-9) & (np.abs(y) < 0.01 + 1e-9)),
        np.array(REFERENCE_BLOCK.grasp.centre),
        REFERENCE_BLOCK.fiducials_rest[:4],
        np.zeros(4, dtype=bool),
    )


def by_felupe(
    problem: RetractionProblem, pose: GripperPose, start: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Displacements (n, 3) and nodal forces (n, 3) at a pose, from displacements near it."""
    kind = problem.body.mesh.kind
    cells = problem.body.mesh.cells[:, order_in_felupe(kind)]
    region = FELUPE[kind].region(felupe.Mesh(problem.body.mesh.points, cells, FELUPE[kind].cell_type))
    field = felupe.FieldContainer([felupe.Field(region, dim=3, values=start.copy())])
    mu, lame = MATERIAL.lame
    law = felupe.NeoHookeCompressible(mu=mu) & felupe.Volumetric(bulk=lame)
    body, load = felupe.SolidBody(law, field), felupe.SolidBodyForce(field, values=problem.specific_weight)
    prescribed = np.zeros_like(start)
    gripped = problem.gripped
    prescribed[gripped] = problem.gripped_positions(pose) - problem.body.mesh.points[gripped]
    held = np.repeat(problem.fixed | gripped, 3)
    result = felupe.newtonraphson(
        x0=field,
        items=[body, load],
        dof0=np.flatnonzero(held),
        dof1=np.flatnonzero(~held),
        ext0=prescribed.reshape(-1)[held],
        tol=1e-12,
        verbose=False,
    )
    assert result.success
    # What it gives of a body force is the load itself, which its Newton iteration takes off.
    forces = body.assemble.vector() - load.assemble.vector()
    return field[0].values, forces.toarray().reshape(-1, 3)


def plain(problem: RetractionProblem) -> RetractionProblem:
    """The same without projected dilatation."""
    body = problem.body
    return replace(problem, body=replace(body, basis=np.zeros((*body.volume.shape, 0))))


@pytest.mark.parametrize("kind", FELUPE)
@pytest.mark.parametrize("specific_weight", [(0.0, 0.0, 0.0), (0.0, 1e3, -3e3)])
def test_the_same_elements_give_the_same_forces_and_displacements(
    kind: ElementKind, specific_weight: tuple[float, float, float]
) -> None:
    """Without projected dilatation the elements are the same; so are all nodal values, to the solvers' tolerance."""
    problem = replace(plain(problem_on(kind)), specific_weight=np.array(specific_weight))
    last = follow(problem, MATERIAL, POSES)[-1]
    displacement = np.zeros_like(last.displacement)
    for pose in POSES:
        displacement, forces = by_felupe(problem, pose, displacement)
    np.testing.assert_allclose(last.displacement, displacement, atol=1e-9)
    np.testing.assert_allclose(last.forces, forces, atol=1e-8)
    assert np.abs(last.displacement).max() > 0.01


def test_with_and_without_projected_dilatation_elements_converge_to_one_limit() -> None:
    """At ν = 0.45 plain quadratic elements do not lock yet; the difference is at most of the order of the mesh size."""
    differences = []
    for grasp_m, anchor_m, largest_m in ((10e-3, 20e-3, 30e-3), (4e-3, 8e-3, 20e-3), (2e-3, 6e-3, 12e-3)):
        problem = mesh_experiment(REFERENCE_BLOCK, Grading(grasp_m, anchor_m, largest_m, 2.0, 1))
        projected, unprojected = (
            follow(p, MATERIAL, POSES)[-1].forces[p.gripped].sum(axis=0) for p in (problem, plain(problem))
        )
        differences.append(np.linalg.norm(projected - unprojected) / np.linalg.norm(projected))
    assert differences[0] < 0.05
    assert differences[1] < differences[0] / 1.8
    assert differences[2] < differences[1] / 1.8
