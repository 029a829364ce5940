"""Where the flange is for six joint angles, and which angles continue others to a pose nearby.

The controller's own kinematics are calibrated for the single arm, so that its poses differ from these by a millimetre
or so. Paths are therefore followed from the pose and the angles that the controller tells together.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from robot_drivers.errors import MotionRefusedError
from robot_drivers.protocols import FloatArray, Pose
from robot_drivers.universal_robots.arms import ALPHA, Joints, Lengths

_MOST_STEPS = 20
_CLOSE_M, _CLOSE_RAD = 1e-7, 1e-7


def flange_matrix(lengths: Lengths, joints: Joints) -> FloatArray:
    """Return ``T_base_flange`` (4, 4)."""
    T = np.eye(4)
    for a, d, alpha, q in zip(lengths.a, lengths.d, ALPHA, joints, strict=True):
        T = T @ _link(a, d, alpha, q)
    return T


def flange_pose(lengths: Lengths, joints: Joints) -> Pose:
    """Return ``T_base_flange``."""
    return _pose(flange_matrix(lengths, joints))


def continued(lengths: Lengths, T_base_flange: Pose, near: Joints) -> Joints:
    """Return the joint angles, rad, at a pose close to that of the angles ``near``, by Newton's method.

    Raises
    ------
    MotionRefusedError
        There are none nearby: the arm does not reach, or is next to a singularity.
    """
    target = _matrix(T_base_flange)
    q = np.array(near)
    for _ in range(_MOST_STEPS):
        T, jacobian = _with_jacobian(lengths, q)
        error = np.concatenate(
            [target[:3, 3] - T[:3, 3], Rotation.from_matrix(target[:3, :3] @ T[:3, :3].T).as_rotvec()]
        )
        if np.linalg.norm(error[:3]) < _CLOSE_M and np.linalg.norm(error[3:]) < _CLOSE_RAD:
            q1, q2, q3, q4, q5, q6 = q.tolist()
            return (q1, q2, q3, q4, q5, q6)
        try:
            q = q + np.linalg.solve(jacobian, error)
        except np.linalg.LinAlgError:
            break
    raise MotionRefusedError("the arm does not reach there, or is next to a singularity")


def _with_jacobian(lengths: Lengths, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ``T_base_flange`` (4, 4) and the flange's velocity by the joints' (6, 6), base frame."""
    T, before = np.eye(4), np.empty((6, 4, 4))
    for number, (a, d, alpha, angle) in enumerate(zip(lengths.a, lengths.d, ALPHA, q.tolist(), strict=True)):
        before[number] = T
        T = T @ _link(a, d, alpha, angle)
    axes, arms = before[:, :3, 2], T[:3, 3] - before[:, :3, 3]
    return T, np.concatenate([np.cross(axes, arms), axes], axis=1).T


def _link(a: float, d: float, alpha: float, q: float) -> FloatArray:
    ca, sa, c, s = math.cos(alpha), math.sin(alpha), math.cos(q), math.sin(q)
    return np.array(
        [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0.0, sa, ca, d], [0.0, 0.0, 0.0, 1.0]]
    )


def _matrix(pose: Pose) -> FloatArray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(pose.quaternion_wxyz, scalar_first=True).as_matrix()
    T[:3, 3] = pose.position
    return T


def _pose(T: FloatArray) -> Pose:
    w, i, j, k = Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True).tolist()
    x, y, z = T[:3, 3].tolist()
    return Pose((x, y, z), (w, i, j, k))
