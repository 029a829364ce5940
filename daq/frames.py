"""Rigid transformations and wrenches between frames.

``T_a_b`` is the pose of frame b in frame a: it carries coordinates in b to coordinates in a. So
``compose(T_a_b, T_b_c)`` is ``T_a_c``.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from robot_drivers.protocols import Pose

FloatArray = NDArray[np.float64]

IDENTITY = Pose((0.0, 0.0, 0.0))


def rotation(quaternion_wxyz: ArrayLike) -> Rotation:
    """Return the rotation of one quaternion (4,) or of many (n, 4), scalar first."""
    return Rotation.from_quat(np.roll(np.asarray(quaternion_wxyz, dtype=np.float64), -1, axis=-1))


def quaternions_wxyz(rotations: Rotation) -> FloatArray:
    """Return the quaternions (4,) or (n, 4), scalar first and not negative."""
    return np.roll(rotations.as_quat(canonical=True), 1, axis=-1)


def pose(position: ArrayLike, rotation_a_b: Rotation) -> Pose:
    """Build ``T_a_b`` from the position of b's origin in a (3,), m, and the rotation from b to a."""
    x, y, z = (float(value) for value in np.asarray(position))
    w, i, j, k = (float(value) for value in quaternions_wxyz(rotation_a_b))
    return Pose((x, y, z), (w, i, j, k))


def compose(T_a_b: Pose, T_b_c: Pose) -> Pose:
    """Return ``T_a_c``."""
    R_a_b = rotation(T_a_b.quaternion_wxyz)
    position = np.asarray(T_a_b.position) + R_a_b.apply(T_b_c.position)
    return pose(position, R_a_b * rotation(T_b_c.quaternion_wxyz))


def inverse(T_a_b: Pose) -> Pose:
    """Return ``T_b_a``."""
    R_b_a = rotation(T_a_b.quaternion_wxyz).inv()
    return pose(-R_b_a.apply(T_a_b.position), R_b_a)


def distance(T_a_b: Pose, T_a_c: Pose) -> tuple[float, float]:
    """Return how far two poses are apart: length in m, angle in rad."""
    length = float(np.linalg.norm(np.subtract(T_a_c.position, T_a_b.position)))
    turn = rotation(T_a_b.quaternion_wxyz).inv() * rotation(T_a_c.quaternion_wxyz)
    return length, float(turn.magnitude())


def transform_wrench(T_a_b: Pose, wrench_b: FloatArray) -> FloatArray:
    """Carry wrenches (..., 6) about the origin of b, in b's axes, to the origin and the axes of a.

    Forces in N, torques in N·m: f_a = R f_b, t_a = R t_b + p × f_a.
    """
    R = rotation(T_a_b.quaternion_wxyz).as_matrix()
    force = wrench_b[..., :3] @ R.T
    torque = wrench_b[..., 3:] @ R.T + np.cross(np.asarray(T_a_b.position), force)
    return np.concatenate([force, torque], axis=-1)
