"""What the gripper feels of the tissue that it holds, also where that slides on it, or moves as was measured.

Such tissue presses on the gripper where it is by then: its arm is to its present place, while what the gripper imposes
on it goes by its place at rest.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.rubbing import handed_on, ways_of_gripper
from estimator.fem.equilibrium.state import EquilibriumState, modes_of, rigid_modes, turned

FloatArray = NDArray[np.float64]


def wrench_of(problem: RetractionProblem, state: EquilibriumState) -> FloatArray:
    """Return force (N) and torque (N·m) of the tissue on the gripper, about its frame's origin, (6,)."""
    rubbed = None
    if state.rubbing is not None:
        rubbed = state.rubbing.on_gripper(state.rubbing.forces.reshape(-1, 1))[:, 0]
    return wrench_by_forces(problem, state, state.forces.reshape(-1)[problem.pattern.gripped], rubbed=rubbed)


def wrench_by_forces(
    problem: RetractionProblem,
    state: EquilibriumState,
    forces: FloatArray,
    motion: FloatArray | None = None,
    rubbed: FloatArray | None = None,
) -> FloatArray:
    """Return the wrench (6,) or (6, k) on the gripper of forces (ng,) or (ng, k) on what it holds, N.

    Parameters
    ----------
    motion : (3n, k) of the nodes, by which what slides changes its arm under the state's own forces, m, with what is
        imposed held still; None for none
    rubbed : (3n,) or (3n, k) forces with which the tissue rubs on the gripper, as they join the internal ones, N
    """
    if problem.grips_rigidly:
        return np.asarray(-rigid_modes(problem, state.pose).T @ forces)
    arms = problem.body.mesh.points + state.displacement - state.pose.position
    on_nodes = np.zeros((arms.size, *forces.shape[1:]))
    on_nodes[problem.pattern.gripped] = forces
    on_nodes[~np.outer(problem.gripped, problem.grips_along).ravel()] = 0.0
    if rubbed is not None:
        on_nodes -= rubbed
    of_gripper = np.repeat(problem.gripped, 3)
    felt = -modes_of(arms).reshape(-1, 6)[of_gripper].T @ on_nodes[of_gripper]
    if motion is not None:
        moved = motion.reshape(len(arms), 3, -1)[problem.gripped]
        felt[3:] -= np.cross(moved, reaction(problem, state)[:, :, None], axis=1).sum(axis=0)
    return np.asarray(felt)


def wrench_by_pose(problem: RetractionProblem, state: EquilibriumState) -> FloatArray:
    """Return the derivative (6, 6) of the wrench by the gripper's translation (m) and rotation (rad)."""
    modes = rigid_modes(problem, state.pose)
    forces = state.tangent.gripped_free @ state.by_pose + state.tangent.gripped @ modes
    motion = np.zeros((state.displacement.size, 6))
    motion[problem.pattern.free], motion[problem.pattern.gripped] = state.by_pose, modes
    rubbed = None
    if state.rubbing is not None:
        ways = motion - ways_of_gripper(problem, state.rubbing, state.pose)
        rubbed = handed_on(problem, state, ways, forces)
    felt = wrench_by_forces(problem, state, forces, rubbed=rubbed)
    # The arms turn with the gripper, and the torque of the reaction with them.
    if problem.grips_rigidly:
        arms = turned(problem.gripped_positions(state.pose) - state.pose.position)
    else:
        arms = motion.reshape(-1, 3, 6)[problem.gripped] - np.eye(3, 6)
    felt[3:, -arms.shape[2] :] -= np.cross(arms, reaction(problem, state)[:, :, None], axis=1).sum(axis=0)
    return felt


def reaction(problem: RetractionProblem, state: EquilibriumState) -> FloatArray:
    """Return the forces (g, 3) on the gripped nodes that the gripper takes, N."""
    held = np.where(problem.grips_along, state.forces[problem.gripped], 0.0)
    return held if state.rubbing is None else held - state.rubbing.forces[problem.gripped]
