"""Uniform meshes of the block with linear tetrahedra, as the paper has them; near incompressibility they lock."""

from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.boundary.problem import HeldNodes, RetractionProblem, retraction_problem
from estimator.fem.discretisation.block_mesh import structured_mesh
from estimator.fem.discretisation.mesh import Mesh

FloatArray = NDArray[np.float64]

# Number of a hexahedron's corner in each direction, in the order of a structured mesh.
_CORNER = np.array([4, 2, 1])
_NEAR = 1e-9


def tetrahedral_mesh(lines: list[FloatArray]) -> Mesh:
    """Split every cell between ``lines`` along x, y, z into six tetrahedra around its diagonal (H. W. Kuhn, 1960)."""
    blocks = structured_mesh(lines, "hex8")
    split = []
    for axes in permutations(range(3)):
        first, second, _ = np.cumsum(_CORNER[list(axes)])
        ends = [0, first, second, 7]
        odd = np.linalg.det(np.eye(3)[list(axes)]) < 0
        split.append(ends if not odd else [0, second, first, 7])
    return Mesh(blocks.points, blocks.cells[:, np.array(split)].reshape(-1, 4), "tet4")


def block_of_tetrahedra(experiment: Experiment, cells: tuple[int, int, int]) -> RetractionProblem:
    """Pose a block's retraction on six linear tetrahedra for each of so many cells along x, y and z.

    The planes nearest to the faces of the grasp are moved there, so that it is covered exactly.
    """
    half = np.array(experiment.phantom.size_m) / 2
    grasp = np.clip([experiment.grasp.box.lower, experiment.grasp.box.upper], -half, half)
    lines = [np.linspace(-half[axis], half[axis], cells[axis] + 1) for axis in range(3)]
    for line, planes in zip(lines, grasp.T, strict=True):
        for plane in planes:
            line[np.argmin(np.abs(line - plane))] = plane
    mesh = tetrahedral_mesh(lines)
    fixed = np.any([anchor.contains(_rounded(mesh.points)) for anchor in experiment.anchors], axis=0)

    def gripped(points: FloatArray) -> NDArray[np.bool_]:
        return np.asarray(np.all((points > grasp[0] - _NEAR) & (points < grasp[1] + _NEAR), axis=1))

    beads = experiment.fiducials_rest
    centre = np.asarray(experiment.grasp.centre)
    return retraction_problem(mesh, HeldNodes(fixed, gripped(mesh.points)), centre, beads, gripped(beads))


def _rounded(points: FloatArray) -> FloatArray:
    """Return points without the last digits of their arithmetic, m."""
    return np.round(points, 9)
