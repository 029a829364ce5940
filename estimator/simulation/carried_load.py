"""Where a free gripper goes that carries a load: the poses at which the tissue pulls as the load does."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.diagnosis.model.solution import Solution, mechanics_of
from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.forward.model import Progress
from estimator.simulation.equilibria import solve_truth
from estimator.simulation.truth import Truth

FloatArray = NDArray[np.float64]

_ROUNDS = 60
# A step of Newton's method goes no farther than this share of the longest edge, and turns no farther, rad.
_FARTHEST, _LARGEST_TURN = 0.1, 0.15
# The pose has settled once a step is below this share of the longest edge, and of a radian.
_SETTLED = 1e-6


def solve_carrying(
    problem: RetractionProblem,
    planned: Sequence[Experiment],
    truth: Truth,
    progress: Progress | None = None,
) -> list[Solution]:
    """Solve a case of which some experiments are driven by the load that their wrench columns state.

    Their gripper begins at rest and goes, row by row, to where the tissue carries the load, by Newton's method in its
    pose; whatever else is true acts on the way. The others follow their planned poses.

    Raises
    ------
    SolverError
        A load has no equilibrium near the last one, or as :func:`estimator.simulation.equilibria.solve_truth`.
    """
    free = [number for number, one in enumerate(planned) if one.driven == "load"]
    if not free:
        return solve_truth(problem, planned, truth, progress)
    moved = list(planned)
    for number in free:
        moved[number] = _at_rest(moved[number])
    longest = max(planned[0].phantom.size_m)
    for _ in range(_ROUNDS):
        solutions = solve_truth(problem, moved, truth, progress)
        farthest = 0.0
        for number in free:
            steps = _newton_steps(solutions[number], moved[number].wrench)
            size = np.abs(steps) / np.repeat([longest, 1.0], 3)
            farthest = max(farthest, float(size.max()))
            too_far = (size / np.repeat([_FARTHEST, _LARGEST_TURN], 3)).max(axis=1, keepdims=True)
            moved[number] = _stepped(moved[number], steps / np.maximum(too_far, 1.0))
        if farthest < _SETTLED:
            return solutions
    raise SolverError("the gripper does not settle under its load; give smaller loads, or stiffer tissue")


def _at_rest(experiment: Experiment) -> Experiment:
    """Return the experiment with its gripper at rest, and poses that are told apart however near they are."""
    rows = len(experiment.time)
    return replace(
        experiment,
        position=np.tile(experiment.grasp.centre, (rows, 1)),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)),
        sensor=replace(experiment.sensor, position_std=0.0),
    )


def _newton_steps(solution: Solution, load: FloatArray) -> FloatArray:
    """Return by how much (n, 6) the gripper is to move, m and rad, for the tissue to pull at it as the load (n, 6).

    Along what slides on it a motion changes nothing, and none is taken.
    """
    mechanics = mechanics_of(solution)
    seen = [mechanics.observations[step] for step in solution.load_steps.of_row]
    return np.array(
        [
            np.linalg.lstsq(one.wrench_by_pose, carried - one.wrench)[0]
            for one, carried in zip(seen, load, strict=True)
        ]
    )


def _stepped(experiment: Experiment, steps: FloatArray) -> Experiment:
    rotation = Rotation.from_rotvec(steps[:, 3:]) * Rotation.from_quat(
        experiment.quaternion_wxyz, scalar_first=True
    )
    return replace(
        experiment,
        position=experiment.position + steps[:, :3],
        quaternion_wxyz=rotation.as_quat(scalar_first=True, canonical=True),
    )
