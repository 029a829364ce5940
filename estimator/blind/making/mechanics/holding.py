"""How a body is held: fixed, and gripped by a gripper in a pose, rigidly or through what lies between."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from estimator.blind.making.mechanics.body import Body
from estimator.blind.making.mechanics.grip import Grip
from estimator.blind.making.mechanics.response import Material
from estimator.blind.making.mechanics.surfaces import LoadedFace

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pose:
    """Origin (3,) m and orientation of the gripper frame in the tissue frame."""

    position: FloatArray
    rotation: Rotation

    def towards(self, other: "Pose", share: float) -> "Pose":
        """Return a pose on the straight way to another one."""
        turn = Slerp([0.0, 1.0], Rotation.concatenate([self.rotation, other.rotation]))
        return Pose(self.position + share * (other.position - self.position), turn(share))


@dataclass(frozen=True, slots=True)
class HeldBody:
    """A body, how it is held, and what acts on it.

    Attributes
    ----------
    fixed, gripped : (n,) nodes that do not move, and that move with the gripper
    rest : the gripper's pose in which the gripped nodes are where the mesh has them
    body_force : (3,) N/m³
    faces : outer faces with a traction
    grip : what lies between gripper and tissue; None holds rigidly
    heavy : (e·q,) share of the body force that acts; None: all of it
    """

    body: Body
    material: Material
    fixed: NDArray[np.bool_]
    gripped: NDArray[np.bool_]
    rest: Pose
    body_force: FloatArray
    faces: tuple[LoadedFace, ...] = ()
    grip: Grip | None = None
    heavy: FloatArray | None = None

    def held_displacements(self, pose: Pose, offset: FloatArray) -> FloatArray:
        """Return displacements (ng, 3), m, of the gripped nodes at a pose, offset by (6,) in the gripper's frame."""
        points = self.body.mesh.points[self.gripped]
        local = self.rest.rotation.inv().apply(points - self.rest.position)
        moved = Rotation.from_rotvec(offset[3:]).apply(local) + self._follows(local)[:, None] * offset[:3]
        return pose.rotation.apply(moved) + pose.position - points

    def _follows(self, local: FloatArray) -> FloatArray:
        """Return which share of the offset the gripped nodes at places (ng, 3) in the gripper's frame take."""
        uneven = None if self.grip is None else self.grip.evenness
        return np.ones(len(local)) if uneven is None else uneven(local)

    def levers(self, pose: Pose, offset: FloatArray) -> FloatArray:
        """Return the displacements of the gripped degrees of freedom by the offset, (3 ng, 6); 0 if held rigidly."""
        points = self.body.mesh.points[self.gripped]
        if self.grip is None:
            return np.zeros((points.size, 6))
        R = pose.rotation.as_matrix()
        follows = self._follows(self.rest.rotation.inv().apply(points - self.rest.position))
        arms = points + self.held_displacements(pose, offset) - pose.position
        arms = arms - follows[:, None] * (R @ offset[:3])
        turning = np.cross(R.T[None, :, :], arms[:, None, :])
        levers = np.concatenate([follows[:, None, None] * R.T, turning], axis=1)
        return np.swapaxes(levers, 1, 2).reshape(-1, 6)

    def wrench(self, pose: Pose, u: FloatArray, held_force: FloatArray) -> FloatArray:
        """Return what the tissue exerts on the gripper, (6,) in the tissue frame about the gripper's origin.

        Parameters
        ----------
        u : (n, 3) displacements, m
        held_force : (3 ng,) that the gripper exerts on the gripped nodes, N
        """
        force = -held_force.reshape(-1, 3)
        arms = (self.body.mesh.points + u)[self.gripped] - pose.position
        return np.concatenate([force.sum(axis=0), np.cross(arms, force).sum(axis=0)])
