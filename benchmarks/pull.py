"""The Pull that every measurement is made on, its converged solution, and how times are taken."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import felupe
import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from estimator.experiment import Experiment
from estimator.fem.boundary.problem import HeldNodes, RetractionProblem, retraction_problem
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.materials.material import Material
from estimator.studies.paper_tables.block import GRASP_CENTRE, MOTIONS, TRUTH, block
from estimator.studies.paper_tables.tetrahedra import block_of_tetrahedra

FloatArray = NDArray[np.float64]
T = TypeVar("T")

POSES = MOTIONS["pull"].poses()
PULL: Experiment = block(POSES)
_REFERENCE = Path(__file__).resolve().parents[1] / "tests" / "data" / "reference"


@dataclass(frozen=True)
class Reference:
    """The converged solution: force (10,) that the gripper exerts, N; fiducial displacements (10, 16, 3), m."""

    force: FloatArray
    fiducials: FloatArray


def reference(poisson_ratio: float) -> Reference:
    """Return the converged solution for ν = 0.35 or 0.49; its origin is told beside it."""
    table = np.loadtxt(_REFERENCE / f"pull_nu{poisson_ratio}.csv", delimiter=",", skiprows=1)
    return Reference(table[:, 2], table[:, 3:].reshape(10, 16, 3))


def tissue(poisson_ratio: float) -> Material:
    """Return the material of the reference solutions."""
    return replace(TRUTH, poisson_ratio=poisson_ratio)


def quadratic_tetrahedra(cells: tuple[int, int, int]) -> RetractionProblem:
    """Return the block on uniform tetrahedra with a node in the middle of each edge."""
    linear = block_of_tetrahedra(PULL, cells).body.mesh
    mesh = felupe.Mesh(linear.points, linear.cells, "tetra").add_midpoints_edges()
    grasp = PULL.grasp.box
    return retraction_problem(
        Mesh(mesh.points, mesh.cells, "tet10"),
        HeldNodes(
            np.isclose(mesh.points[:, 0], -PULL.phantom.size_m[0] / 2),
            np.asarray(grasp.contains(np.round(mesh.points, 9))),
        ),
        np.array(GRASP_CENTRE),
        PULL.fiducials_rest,
        np.asarray(grasp.contains(np.round(PULL.fiducials_rest, 9))),
    )


def solve_pull(problem: RetractionProblem, material: Material) -> list[EquilibriumState]:
    """Solve the ten states one after the other, from rest."""
    solver = EquilibriumSolver(problem)
    states = [solver.rest(material)]
    for pose in POSES[1:]:
        states.append(solver.solve(pose, material, states[-1]))
    return states[1:]


def errors(
    problem: RetractionProblem, states: Sequence[EquilibriumState], exact: Reference
) -> tuple[float, float]:
    """Return the largest error of the force, a share of it, and of a fiducial's coordinate, m, over all steps."""
    force = np.array([float(state.forces[problem.gripped, 0].sum()) for state in states])
    seen = np.array([observe(problem, state).fiducials for state in states]) - PULL.fiducials_rest
    return float(np.abs(force / exact.force - 1).max()), float(np.abs(seen - exact.fiducials).max())


def unknowns(problem: RetractionProblem) -> int:
    """Return how many degrees of freedom are free."""
    return len(problem.pattern.free)


@dataclass(frozen=True, slots=True)
class Timing:
    """What a run took: seconds by the clock, and of the processor, which other programs on the machine hardly touch."""

    wall_s: float
    cpu_s: float

    def __str__(self) -> str:
        return f"{self.wall_s:.2f} s ({self.cpu_s:.2f} s of one core)"


def timed(run: Callable[[], T]) -> tuple[T, Timing]:
    """Carry out a run in one thread, and time it."""
    with threadpool_limits(1):
        wall, cpu = time.perf_counter(), time.process_time()
        result = run()
        return result, Timing(time.perf_counter() - wall, time.process_time() - cpu)


def fastest(run: Callable[[], object], repeats: int) -> Timing:
    """Return the shortest times of a run, after one that is not counted."""
    return fastest_of_each((run,), repeats)[0]


def fastest_of_each(runs: Sequence[Callable[[], object]], repeats: int) -> list[Timing]:
    """Return the shortest times of runs that take turns, so that each has its share of a machine's good moments.

    A first turn is not counted.
    """
    turns = [[timed(run)[1] for run in runs] for _ in range(repeats + 1)][1:]
    return [
        Timing(min(t.wall_s for t in of_one), min(t.cpu_s for t in of_one))
        for of_one in zip(*turns, strict=True)
    ]
