"""Equilibria of tissue that rubs on what holds it: how what rubs enters the tangent, and follows pose and loads.

What rubs at a node grows with what its plate presses with, the reaction of held degrees of freedom. So the free forces
change by W times whatever changes these reactions, in the tangent as in every load: a matrix of low rank beside the
symmetric one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.tangent import Tangent
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.state import EquilibriumState, modes_of, rigid_modes
from estimator.fem.terms.rubbing import Rubbing

FloatArray = NDArray[np.float64]


def with_rubbing(problem: RetractionProblem, tangent: Tangent, rubbing: Rubbing) -> Tangent:
    """Return a tangent, which has the blocks of what rubs already, with what follows the held forces."""
    pattern = problem.pattern
    return tangent.with_following(rubbing.along[pattern.free], rubbing.by_forces[:, pattern.gripped])


def load_by_pose(
    problem: RetractionProblem, tangent: Tangent, rubbing: Rubbing | None, pose: GripperPose
) -> FloatArray:
    """Return the change (nf, 6) of the free nodal forces by the gripper's translation (m) and rotation (rad)."""
    modes = rigid_modes(problem, pose)
    load = tangent.gripped_free.T @ modes
    if rubbing is not None:
        held = _whole(problem, tangent.gripped @ modes)
        more = rubbing.following(held) - rubbing.of_ways(ways_of_gripper(problem, rubbing, pose))
        load = load + more[problem.pattern.free]
    return np.asarray(load)


def ways_of_gripper(problem: RetractionProblem, rubbing: Rubbing, pose: GripperPose) -> FloatArray:
    """Return how far (3n, 6) the gripper's plate carries the points that tissue sticks to, as it moves from a pose."""
    modes: FloatArray = np.zeros((*problem.body.mesh.points.shape, 6))
    modes[problem.gripped] = modes_of(problem.gripped_positions(pose) - pose.position)
    return rubbing.on_gripper(modes.reshape(-1, 6))


def following(state: EquilibriumState, loads: FloatArray) -> FloatArray:
    """Return by what loads (3n, k) of the tissue alone change what rubs at a state, (3n, k)."""
    return np.zeros_like(loads) if state.rubbing is None else state.rubbing.following(loads)


def handed_on(
    problem: RetractionProblem,
    state: EquilibriumState,
    motion: FloatArray,
    held: FloatArray,
    own: FloatArray | None = None,
) -> FloatArray | None:
    """Return what of a change the tissue rubs on the gripper with, (3n, k); None where nothing rubs.

    Parameters
    ----------
    motion : (3n, k) of the nodes on their plates, m
    held : (ng, k) change of the forces on what is held
    own : (3n, k) change of what rubs by itself, at the same place under the same pressure
    """
    if state.rubbing is None:
        return None
    change = state.rubbing.of_ways(motion) + state.rubbing.following(_whole(problem, held))
    return state.rubbing.on_gripper(change if own is None else change + own)


def _whole(problem: RetractionProblem, held: FloatArray) -> FloatArray:
    """Return forces (ng, k) on what is held as forces (3n, k) on all nodes."""
    whole: FloatArray = np.zeros((problem.body.mesh.points.size, *held.shape[1:]))
    whole[problem.pattern.gripped] = held
    return whole
