"""Rigid motions of the gripper."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class GripperPose:
    """The gripper frame in the tissue frame: origin (3,) in m and rotation; identity rotation at rest."""

    position: FloatArray
    rotation: Rotation

    @staticmethod
    def from_quaternion(position: FloatArray, quaternion_wxyz: FloatArray) -> "GripperPose":
        """Build a pose from an origin (3,), m, and a quaternion (4,) with the scalar first."""
        return GripperPose(
            np.asarray(position, dtype=float), Rotation.from_quat(quaternion_wxyz, scalar_first=True)
        )

    def increment_to(self, other: "GripperPose") -> FloatArray:
        """Return translation (m) and rotation vector (rad, tissue axes) that lead from here to ``other``, (6,)."""
        turn = (other.rotation * self.rotation.inv()).as_rotvec()
        return np.concatenate([other.position - self.position, turn])

    def between(self, other: "GripperPose", fraction: float) -> "GripperPose":
        """Return the pose at a fraction of the way: straight in position, constant rate in orientation."""
        slerp = Slerp([0.0, 1.0], Rotation.concatenate([self.rotation, other.rotation]))
        return GripperPose(self.position + fraction * (other.position - self.position), slerp(fraction))
