"""A gripper that holds nothing: beads on the table stand still, and one marker rides on the gripper."""

from dataclasses import dataclass

import numpy as np

from daq.frames import rotation
from daq.rig import Vector
from daq.virtual_rig.physics.phantom import PhantomState
from robot_drivers.protocols import Pose


@dataclass(frozen=True, slots=True)
class FreeAir:
    """Nothing is held.

    Attributes
    ----------
    beads : that stand still, tissue frame, m
    marker : on the gripper, gripper frame, m
    """

    beads: tuple[Vector, ...]
    marker: Vector

    def build(self) -> "FreeAir":
        """Return itself: it needs no preparation."""
        return self

    def truth(self) -> dict[str, float]:
        """Return the marker's place."""
        return {f"marker_{axis}": value for axis, value in zip("xyz", self.marker, strict=True)}

    def solve(self, T_tissue_gripper: Pose) -> PhantomState:
        """Return the state at any pose; the marker is the last of the beads."""
        arm = rotation(T_tissue_gripper.quaternion_wxyz).apply(self.marker)
        beads = np.vstack([np.array(self.beads).reshape(-1, 3), arm + T_tissue_gripper.position])
        by_pose = np.zeros((len(beads), 3, 6))
        by_pose[-1, :, :3] = np.eye(3)
        by_pose[-1, :, 3:] = np.cross(np.eye(3), arm).T
        return PhantomState(T_tissue_gripper, np.zeros(6), beads, np.zeros((6, 6)), by_pose)
