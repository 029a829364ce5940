"""A sheet meshed as coarsely as it goes, and ways to try an effect of the tissue on it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK
from scipy.spatial.transform import Rotation

from estimator.fem.assembly.body import Response, respond, stiffness
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.fem.terms.term import Term
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material, make_material

FloatArray = NDArray[np.float64]

PROBLEM = mesh_experiment(
    REFERENCE_BLOCK, Grading(grasp_m=3e-3, anchor_m=8e-3, largest_m=25e-3, growth=3.0, layers=1)
)
TISSUE = make_material(NeoHookean(), 1e4, 0.4)


def smooth_field(strain: float = 0.1, seed: int = 1) -> FloatArray:
    """Nodal displacements (n, 3) of a smooth deformation, different in every element."""
    rng = np.random.default_rng(seed)
    points = PROBLEM.body.mesh.points
    waves = np.sin(points @ rng.normal(scale=30.0, size=(3, 3)) + rng.uniform(0, 6, 3))
    return strain * (points @ rng.normal(scale=0.5, size=(3, 3)) + 0.03 * waves)


def response_to(displacement: FloatArray, material: Material = TISSUE) -> Response:
    return respond(PROBLEM.body, material, displacement)


def stiffness_of(term: Term, displacement: FloatArray, material: Material = TISSUE) -> FloatArray:
    """What a term adds to the elements' stiffness, (e, 3k, 3k)."""
    response = response_to(displacement, material)
    found, body = term.stiffness(displacement, response), PROBLEM.body
    alone, together = (
        stiffness(body, material, response, response.pressure, each) for each in (None, found.energy)
    )
    return together - alone + (0.0 if found.elements is None else found.elements)


def times_change(elements: FloatArray, change: FloatArray) -> FloatArray:
    """Multiply element matrices, of which the lower triangle counts, with nodal displacements (n, 3)."""
    lower = np.tril(elements)
    whole = lower + np.tril(elements, -1).swapaxes(1, 2)
    cells = PROBLEM.body.mesh.cells
    forces = np.einsum("eij,ej->ei", whole, change[cells].reshape(len(cells), -1)).reshape(-1, 3)
    return np.stack(
        [np.bincount(cells.ravel(), forces[:, i], minlength=len(change)) for i in range(3)], axis=1
    )


def force_change(term: Term, displacement: FloatArray, change: FloatArray, material: Material) -> FloatArray:
    """The derivative of a term's forces along ``change`` by a central difference."""
    step = 1e-5
    ahead, back = (displacement + sign * step * change for sign in (1, -1))
    forces = [term.forces(u, response_to(u, material)) for u in (ahead, back)]
    return (forces[0] - forces[1]) / (2 * step)


def pulled_to(*lengths_mm: float) -> list[GripperPose]:
    start = np.array(REFERENCE_BLOCK.grasp.centre)
    return [GripperPose(start + np.array([1e-3 * mm, 0, 0]), Rotation.identity()) for mm in lengths_mm]


def driven(
    poses: Sequence[GripperPose],
    terms: tuple[Term, ...] = (),
    seconds: Sequence[float] | None = None,
    problem: RetractionProblem = PROBLEM,
    material: Material = TISSUE,
) -> tuple[FloatArray, EquilibriumState, tuple[Term, ...]]:
    """Solve the poses in turn; return the pulling forces (n,), N, the last state, and the terms after it."""
    solver = EquilibriumSolver(problem)
    state, pulls = solver.rest(material), []
    for pose, elapsed in zip(poses, seconds or np.ones(len(poses)), strict=True):
        terms = tuple(term.starting_after(elapsed) for term in terms)
        state = solver.solve(pose, material, state, terms)
        terms = tuple(term.after(state.displacement, state.response) for term in terms)
        pulls.append(-observe(problem, state).wrench[0])
    return np.array(pulls), state, terms
