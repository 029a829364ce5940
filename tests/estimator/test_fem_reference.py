"""The Pull against a converged solution of another engine; convergence under refinement; no locking."""

from pathlib import Path

import felupe
import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import COARSE_GRADING, REFERENCE_BLOCK, REFERENCE_PATHS, follow, straight_pull

from estimator.fem.boundary.problem import HeldNodes, RetractionProblem, retraction_problem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.elements import ElementKind
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.equilibrium.observation import observe
from estimator.forward.gradings import DEFAULT_GRADING
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

REFERENCE = Path(__file__).resolve().parents[1] / "data" / "reference"
YOUNGS_MODULUS = 15e3
MIDDLE_GRADING = Grading(grasp_m=2e-3, anchor_m=6e-3, largest_m=12e-3, growth=2.0, layers=1)


def reference_pull(poisson_ratio: float) -> tuple[FloatArray, FloatArray]:
    """Force (10,) that the gripper exerts, N, and displacements (10, 16, 3) of the fiducials, m."""
    table = np.loadtxt(REFERENCE / f"pull_nu{poisson_ratio}.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], [pose.position[0] - 0.04 for pose in REFERENCE_PATHS["pull"]])
    return table[:, 2], table[:, 3:].reshape(10, 16, 3)


def material(poisson_ratio: float) -> Material:
    return Material(NeoHookean(), YOUNGS_MODULUS, poisson_ratio)


def pull_force(
    problem: RetractionProblem, poisson_ratio: float, length_m: float = 0.02, steps: int = 4
) -> float:
    """Force along x on the gripped nodes at the end of a pull, N."""
    last = follow(problem, material(poisson_ratio), straight_pull(REFERENCE_BLOCK, length_m, steps))[-1]
    return float(last.forces[problem.gripped, 0].sum())


def linear_tetrahedra(cells_per_edge: int) -> RetractionProblem:
    """A uniform mesh of the reference block, without fiducials."""
    block = felupe.Cube(
        a=(-0.05, -0.05, -0.005), b=(0.05, 0.05, 0.005), n=(cells_per_edge + 1, cells_per_edge + 1, 3)
    )
    split = block.triangulate()
    x, y, _ = split.points.T
    gripped = (x > 0.03 - 1e-9) & (np.abs(y) < 0.01 + 1e-9)
    mesh = Mesh(split.points, split.cells, "tet4")
    no_fiducials = np.zeros((0, 3)), np.zeros(0, dtype=bool)
    return retraction_problem(
        mesh, HeldNodes(np.isclose(x, -0.05), gripped), np.array([0.04, 0.0, 0.0]), *no_fiducials
    )


@pytest.mark.parametrize("poisson_ratio", [0.35, 0.49])
def test_the_default_mesh_gives_the_reference_force_and_fiducials_at_every_step(poisson_ratio: float) -> None:
    problem = mesh_experiment(REFERENCE_BLOCK)
    force, displacement = reference_pull(poisson_ratio)
    seen = [
        observe(problem, state) for state in follow(problem, material(poisson_ratio), REFERENCE_PATHS["pull"])
    ]
    wrench = np.array([observation.wrench for observation in seen])
    np.testing.assert_allclose(-wrench[:, 0], force, rtol=3e-3)
    np.testing.assert_allclose(wrench[:, 1:], 0.0, atol=1e-9)
    fiducials = np.array([observation.fiducials for observation in seen])
    np.testing.assert_allclose(fiducials - REFERENCE_BLOCK.fiducials_rest, displacement, atol=20e-6)


def test_the_force_converges_to_the_reference_as_the_mesh_is_refined() -> None:
    exact = reference_pull(0.49)[0][-1]
    errors = [
        abs(pull_force(mesh_experiment(REFERENCE_BLOCK, grading), 0.49) / exact - 1)
        for grading in (COARSE_GRADING, MIDDLE_GRADING, DEFAULT_GRADING)
    ]
    assert errors[0] < 0.01
    assert errors[1] < errors[0] / 1.8
    assert errors[2] < errors[1] / 1.8


@pytest.mark.parametrize(
    ("kind", "grading", "tolerance"),
    [
        ("hex8", Grading(grasp_m=2e-3, anchor_m=4e-3, largest_m=5e-3, growth=1.5, layers=2), 0.02),
        ("hex64", Grading(grasp_m=5e-3, anchor_m=10e-3, largest_m=20e-3, growth=2.0, layers=1), 0.006),
    ],
)
def test_linear_and_cubic_elements_reach_the_reference_too(
    kind: ElementKind, grading: Grading, tolerance: float
) -> None:
    problem = mesh_experiment(REFERENCE_BLOCK, grading, kind)
    exact = reference_pull(0.49)[0][-1]
    assert pull_force(problem, 0.49) == pytest.approx(exact, rel=tolerance)


def test_the_mesh_does_not_lock_as_the_tissue_becomes_incompressible() -> None:
    """The force of a coarse mesh is as near to the default mesh's at ν = 0.4999 as at 0.49."""
    problems = [mesh_experiment(REFERENCE_BLOCK, grading) for grading in (COARSE_GRADING, DEFAULT_GRADING)]
    forces = {nu: [pull_force(problem, nu) for problem in problems] for nu in (0.49, 0.4999)}
    excess = {nu: coarse / default - 1 for nu, (coarse, default) in forces.items()}
    assert abs(excess[0.4999]) < 0.01
    assert abs(excess[0.4999] - excess[0.49]) < 0.001


def test_linear_tetrahedra_do_lock() -> None:
    """Why they are not used: at ν = 0.49 they are far too stiff, and at 0.4999 they are so many times more."""
    problem = linear_tetrahedra(20)
    exact = reference_pull(0.49)[0][-1]
    nearly, almost = (pull_force(problem, nu) / exact - 1 for nu in (0.49, 0.4999))
    assert nearly > 0.15
    assert almost > 2 * nearly
