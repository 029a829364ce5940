"""The Pull that every measurement is made on, its converged solution, and how times are taken."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import felupe
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.experiment import Box, Environment, Experiment, Grasp, Phantom, SensorNoise
from estimator.fem.block_mesh import structured_mesh
from estimator.fem.elements import ElementKind
from estimator.fem.equilibrium import EquilibriumSolver, EquilibriumState, NewtonSettings
from estimator.fem.mesh import Mesh
from estimator.fem.motion import GripperPose
from estimator.fem.observation import observe
from estimator.fem.problem import RetractionProblem, retraction_problem
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

YOUNGS_MODULUS = 15e3
STEPS = 10
_REFERENCE = Path(__file__).resolve().parents[1] / "tests" / "data" / "reference"
_CENTRE = np.array([0.04, 0.0, 0.0])
_ROWS_M = (-0.03, -0.01, 0.01, 0.03)
_BEADS = np.array([(x, y, 0.005) for x in _ROWS_M for y in _ROWS_M])
# From our order of a hexahedron's nodes to VTK's.
_VTK_HEXAHEDRON = [0, 4, 6, 2, 1, 5, 7, 3]


@dataclass(frozen=True)
class Reference:
    """The converged solution: force (10,) that the gripper exerts, N; fiducial displacements (10, 16, 3), m."""

    force: FloatArray
    fiducials: FloatArray


def reference(poisson_ratio: float) -> Reference:
    """Return the converged solution for ν = 0.35 or 0.49; its origin is told beside it."""
    table = np.loadtxt(_REFERENCE / f"pull_nu{poisson_ratio}.csv", delimiter=",", skiprows=1)
    return Reference(table[:, 2], table[:, 3:].reshape(STEPS, 16, 3))


def block_experiment(wrench: FloatArray, fiducials: FloatArray) -> Experiment:
    """Return the Pull as an experiment of eleven rows, the first at rest, with what was measured in them."""
    rows = STEPS + 1
    return Experiment(
        name="pull",
        phantom_id="reference block",
        order=1,
        phantom=Phantom("block", (0.10, 0.10, 0.01)),
        anchors=(Box((-0.05, -0.05, -0.005), (-0.05, 0.05, 0.005)),),
        grasp=Grasp(Box((0.03, -0.01, -0.005), (0.05, 0.01, 0.005)), (0.04, 0.0, 0.0)),
        trajectory_kind="pull",
        environment=Environment(),
        sensor=SensorNoise(force_std=0.02, torque_std=5e-4, fiducial_std=5e-5, position_std=3e-5),
        fiducials_rest=_BEADS,
        time=np.arange(rows, dtype=float),
        phase=("hold",) * rows,
        step=np.arange(rows),
        position=np.array([_CENTRE, *(pose.position for pose in poses())]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)),
        wrench=wrench,
        fiducials=fiducials,
    )


def unmeasured() -> Experiment:
    """Return the Pull with nothing measured, for the mesher."""
    return block_experiment(np.zeros((STEPS + 1, 6)), np.tile(_BEADS, (STEPS + 1, 1, 1)))


def poses() -> list[GripperPose]:
    """Return the ten poses: 2 mm along +x each."""
    return [
        GripperPose(_CENTRE + np.array([2e-3 * step, 0.0, 0.0]), Rotation.identity())
        for step in range(1, STEPS + 1)
    ]


def material(poisson_ratio: float) -> Material:
    """Return the Neo-Hookean material of the reference solutions."""
    return Material(NeoHookean(), YOUNGS_MODULUS, poisson_ratio)


def tetrahedra(cells: tuple[int, int, int], kind: ElementKind) -> RetractionProblem:
    """Split a structured mesh of about uniform size, its planes fitted to the grasp, into six tetrahedra a cell.

    Parameters
    ----------
    cells : along x, y, z
    kind : "tet4" or "tet10"
    """
    along, across, layers = cells
    gripped_along, gripped_across = round(along / 5), round(across / 10) * 2 - across % 2 + 2 * (across % 2)
    beside = (across - gripped_across) // 2
    lines = [
        _line([-0.05, 0.03, 0.05], [along - gripped_along, gripped_along]),
        _line([-0.05, -0.01, 0.01, 0.05], [beside, gripped_across, beside]),
        _line([-0.005, 0.005], [layers]),
    ]
    blocks = structured_mesh(lines, "hex8")
    split = felupe.Mesh(blocks.points, blocks.cells[:, _VTK_HEXAHEDRON], "hexahedron").triangulate()
    if kind == "tet10":
        split = split.add_midpoints_edges()
    x, y, _ = split.points.T
    gripped = (x > 0.03 - 1e-9) & (np.abs(y) < 0.01 + 1e-9)
    held = np.all(np.abs(_BEADS[:, :2] - [0.04, 0.0]) < 0.01 + 1e-9, axis=1)
    return retraction_problem(
        Mesh(split.points, split.cells, kind), np.isclose(x, -0.05), gripped, _CENTRE, _BEADS, held
    )


def run_pull(
    problem: RetractionProblem, poisson_ratio: float, settings: NewtonSettings | None = None
) -> list[EquilibriumState]:
    """Solve the ten states one after the other, from rest."""
    solver = EquilibriumSolver(problem, settings)
    states = [solver.rest(material(poisson_ratio))]
    for pose in poses():
        states.append(solver.solve(pose, states[0].material, states[-1]))
    return states[1:]


def pulling_force(problem: RetractionProblem, state: EquilibriumState) -> float:
    """Return the force along x that the gripper exerts, N."""
    return float(state.forces[problem.gripped, 0].sum())


def errors(problem: RetractionProblem, states: Sequence[EquilibriumState], exact: Reference) -> tuple[float, float]:
    """Return the largest error of the force, a share of it, and of a fiducial's coordinate, m, over all steps."""
    force = np.array([pulling_force(problem, state) for state in states])
    fiducials = np.array([observe(problem, state).fiducials for state in states]) - _BEADS
    return float(np.abs(force / exact.force - 1).max()), float(np.abs(fiducials - exact.fiducials).max())


def fastest(runs: Sequence[Callable[[], object]], repeats: int) -> list[float]:
    """Return the shortest time of each run, s; the runs take turns, so that a busy machine hits all alike."""
    best = [float("inf")] * len(runs)
    for _ in range(repeats):
        for number, run in enumerate(runs):
            started = time.perf_counter()
            run()
            best[number] = min(best[number], time.perf_counter() - started)
    return best


def _line(breaks: Sequence[float], cells: Sequence[int]) -> FloatArray:
    pieces = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(breaks, breaks[1:], cells, strict=False)]
    return np.append(np.concatenate(pieces), breaks[-1])
