"""The simulated phantom: what the gripper feels and where the beads are, for a pose of the gripper.

A solver may need seconds for a state; the emulated devices ask hundreds of times a second. So every state carries
its derivative by the gripper's motion, and the last two are continued as a cubic until the next one is there.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from daq.frames import rotation
from robot_drivers.motion import poses
from robot_drivers.protocols import FloatArray, Pose


@dataclass(frozen=True, slots=True)
class PhantomState:
    """The phantom at rest under one pose of the gripper; tissue frame.

    Attributes
    ----------
    T_tissue_gripper : the pose
    wrench : (6,) of the tissue on the gripper, N and N·m, about the gripper's origin
    beads : (m, 3) m
    wrench_by_pose : (6, 6) derivative by the gripper's translation (m) and rotation (rad, tissue axes)
    beads_by_pose : (m, 3, 6)
    """

    T_tissue_gripper: Pose
    wrench: FloatArray
    beads: FloatArray
    wrench_by_pose: FloatArray
    beads_by_pose: FloatArray


@dataclass(frozen=True)
class PhantomMotion:
    """The phantom near its last two solved states: cubic along the way between them, linear beside it."""

    before: PhantomState
    newest: PhantomState

    def wrench(self, T_tissue_gripper: Pose) -> FloatArray:
        """Return the wrench (6,) of the tissue on the gripper at a pose near by."""
        fraction, beside = self._place(T_tissue_gripper)
        return self._wrench.at(1.0 + fraction) + self.newest.wrench_by_pose @ beside

    def beads(self, T_tissue_gripper: Pose) -> FloatArray:
        """Return the beads (m, 3) at a pose near by, m."""
        fraction, beside = self._place(T_tissue_gripper)
        return self._beads.at(1.0 + fraction) + self.newest.beads_by_pose @ beside

    def _place(self, T_tissue_gripper: Pose) -> tuple[float, FloatArray]:
        """Return how far a pose lies beyond the newest state, as a share of the way, and the motion (6,) beside it."""
        beside = increment(self.newest.T_tissue_gripper, T_tissue_gripper)
        squared = float(self._way @ self._way)
        if squared == 0.0:
            return 0.0, beside
        fraction = float(beside @ self._way) / squared
        return fraction, beside - fraction * self._way

    @cached_property
    def _way(self) -> FloatArray:
        return increment(self.before.T_tissue_gripper, self.newest.T_tissue_gripper)

    @cached_property
    def _wrench(self) -> "_Cubic":
        before, newest = self.before, self.newest
        return _hermite(
            (before.wrench, newest.wrench),
            (before.wrench_by_pose @ self._way, newest.wrench_by_pose @ self._way),
        )

    @cached_property
    def _beads(self) -> "_Cubic":
        before, newest = self.before, self.newest
        return _hermite(
            (before.beads, newest.beads),
            (before.beads_by_pose @ self._way, newest.beads_by_pose @ self._way),
        )


def increment(T_tissue_a: Pose, T_tissue_b: Pose) -> FloatArray:
    """Return the motion (6,) from a to b: translation in m and rotation vector in rad, tissue axes."""
    (ax, ay, az), (bx, by, bz) = T_tissue_a.position, T_tissue_b.position
    turn = poses.product(T_tissue_b.quaternion_wxyz, poses.conjugate(T_tissue_a.quaternion_wxyz))
    return np.array([bx - ax, by - ay, bz - az, *poses.rotation_vector(turn)])


@dataclass(frozen=True, slots=True)
class _Cubic:
    """The coefficients of a cubic, constant first."""

    coefficients: tuple[FloatArray, FloatArray, FloatArray, FloatArray]

    def at(self, t: float) -> FloatArray:
        constant, slope, curve, bend = self.coefficients
        return constant + t * (slope + t * (curve + t * bend))


def _hermite(values: tuple[FloatArray, FloatArray], slopes: tuple[FloatArray, FloatArray]) -> _Cubic:
    """Return the cubic through both values with both slopes at t = 0 and 1."""
    (start, end), (start_slope, end_slope) = values, slopes
    curve = 3.0 * (end - start) - 2.0 * start_slope - end_slope
    bend = start_slope + end_slope - 2.0 * (end - start)
    return _Cubic((start, start_slope, curve, bend))


class PhantomSolver(Protocol):
    """Finds the state of the phantom; successive poses are near each other."""

    def solve(self, T_tissue_gripper: Pose) -> PhantomState:
        """Return the state under this pose of the gripper."""


class PhantomModel(Protocol):
    """Describes a phantom; it travels to another process, where its solver is built."""

    def build(self) -> PhantomSolver:
        """Return a solver at rest."""

    def truth(self) -> dict[str, float]:
        """Return the true parameters by name, SI."""


@dataclass(frozen=True, slots=True)
class SpringPhantom:
    """A phantom without mechanics: the gripper hangs in springs, the beads follow it by fixed shares.

    Attributes
    ----------
    grasp_centre : the gripper's origin at rest, m
    beads : (x, y, z) of each at rest, m; its share is its place between the faces x = ∓50 mm
    stiffness : N/m along x, y and z
    turning_stiffness : N·m/rad
    """

    grasp_centre: tuple[float, float, float]
    beads: tuple[tuple[float, float, float], ...]
    stiffness: tuple[float, float, float] = (110.0, 60.0, 30.0)
    turning_stiffness: float = 0.05

    def build(self) -> "SpringPhantom":
        """Return itself: it needs no preparation."""
        return self

    def truth(self) -> dict[str, float]:
        """Return the stiffness along x."""
        return {"stiffness_x": self.stiffness[0]}

    def solve(self, T_tissue_gripper: Pose) -> PhantomState:
        """Return the state at any pose."""
        way = np.subtract(T_tissue_gripper.position, self.grasp_centre)
        turn = rotation(T_tissue_gripper.quaternion_wxyz).as_rotvec()
        stiffness = np.diag([*self.stiffness, *[self.turning_stiffness] * 3])
        beads = np.array(self.beads)
        by_pose = np.zeros((len(beads), 3, 6))
        by_pose[:, :, :3] = (0.5 + 10.0 * beads[:, 0])[:, None, None] * np.eye(3)
        return PhantomState(
            T_tissue_gripper,
            wrench=-stiffness @ np.concatenate([way, turn]),
            beads=beads + by_pose[:, :, :3] @ way,
            wrench_by_pose=-stiffness,
            beads_by_pose=by_pose,
        )
