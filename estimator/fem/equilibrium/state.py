"""A solved equilibrium, and where it would move with the gripper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Response
from estimator.fem.assembly.tangent import Tangent
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.rubbing import Rubbing
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# The cubic through the last step is trusted for a motion of up to this many times that step.
_LONGEST_EXTRAPOLATION = 2.0


@dataclass(frozen=True)
class Waypoint:
    """Where a motion has come by: pose, displacement (n, 3) in m, and the field's derivative by the pose (nf, 6)."""

    pose: GripperPose
    displacement: FloatArray
    by_pose: FloatArray


@dataclass(frozen=True)
class EquilibriumState:
    """A solved state.

    Attributes
    ----------
    pose : of the gripper frame in the tissue frame
    material : that it was solved for
    displacement : (n, 3) float64, m
    response : of the material
    forces : (n, 3) float64, nodal forces of tissue and terms, N; zero but at held nodes
    tangent : assembled at the solution
    by_pose : (nf, 6) derivative of the free displacements by the gripper's translation (m) and rotation (rad)
    iterations : Newton iterations spent on it
    before : the state from which the motion led here; None where that is not known
    rubbing : what rubs on what holds the tissue; None where nothing does
    """

    pose: GripperPose
    material: Material
    displacement: FloatArray
    response: Response
    forces: FloatArray
    tangent: Tangent
    by_pose: FloatArray
    iterations: int
    before: Waypoint | None = None
    rubbing: Rubbing | None = None


def rigid_modes(problem: RetractionProblem, pose: GripperPose) -> FloatArray:
    """Return the displacement (ng, 6) of what is imposed per unit of the gripper's translation and rotation."""
    gripped = modes_of(problem.gripped_positions(pose) - pose.position)
    if problem.prescribed is None and problem.pressed is None:
        return gripped[:, problem.grips_along].reshape(-1, 6)
    modes = np.zeros((*problem.body.mesh.points.shape, 6))
    modes[problem.gripped] = gripped
    if problem.prescribed is not None:
        modes[problem.prescribed.led] = 0.0
        modes[problem.prescribed.led, :3] = problem.prescribed.by_position(pose.position)
    return modes.reshape(-1, 6)[problem.pattern.gripped]


def modes_of(arms: FloatArray) -> FloatArray:
    """Return the displacement (n, 3, 6) of arms (n, 3) per unit of translation and rotation."""
    modes = np.zeros((len(arms), 3, 6))
    modes[:, :, :3] = np.eye(3)
    modes[:, :, 3:] = turned(arms)
    return modes


def turned(arms: FloatArray) -> FloatArray:
    """Return the displacement (n, 3, 3) of arms (n, 3) per unit of rotation about each axis: axis × arm."""
    x, y, z = arms.T
    none = np.zeros_like(x)
    return np.stack([none, z, -y, -z, none, x, y, -x, none], axis=1).reshape(-1, 3, 3)


def linear_change(problem: RetractionProblem, start: EquilibriumState, motion: FloatArray) -> FloatArray:
    """Return the change of the displacements (n, 3), m, for a small motion (6,) of the gripper."""
    change: FloatArray = np.zeros(start.displacement.size)
    change[problem.pattern.free] = start.by_pose @ motion
    change[problem.pattern.gripped] = rigid_modes(problem, start.pose) @ motion
    return change.reshape(start.displacement.shape)


def curvature(problem: RetractionProblem, start: EquilibriumState, motion: FloatArray) -> FloatArray:
    """Return what the change of the free displacements (nf,), m, for a motion (6,) has beyond its linear part.

    Along the direction of the last step the field follows the cubic that agrees with it and its derivative at both
    ends of that step (Hermite): back at its start that gives the field that was there.
    """
    free = problem.pattern.free
    if start.before is None:
        return np.zeros(len(free))
    last_motion = start.before.pose.increment_to(start.pose)
    modes = rigid_modes(problem, start.pose)
    last_way = modes @ last_motion
    share = float(last_way @ (modes @ motion)) / max(float(last_way @ last_way), np.finfo(float).tiny)
    if abs(share) > _LONGEST_EXTRAPOLATION:
        return np.zeros(len(free))
    last_change = (start.displacement - start.before.displacement).reshape(-1)[free]
    slope_before, slope = start.before.by_pose @ last_motion, start.by_pose @ last_motion
    quadratic = slope_before + 2.0 * slope - 3.0 * last_change
    cubic = slope_before + slope - 2.0 * last_change
    return share**2 * (quadratic + share * cubic)
