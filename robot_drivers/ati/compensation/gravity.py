"""What hangs on a force sensor: its weight, its centre and the sensor's bias, from readings in several poses.

A sensor that feels nothing but its tool reads, in its own frame and for gravity g (m/s²) in that frame,

    force = m g + b_f,        torque = c × m g + b_t = -[g]× (m c) + b_t,

which is linear in the mass m, the first moment m c and the two biases: ten unknowns, six equations for each pose.
Compare Kubus, Kröger and Wahl, "On-line rigid object recognition and pose estimation based on inertial parameters"
(IROS 2007), at rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from robot_drivers.errors import ConfigurationError
from robot_drivers.protocols import FloatArray, Pose

STANDARD_GRAVITY = (0.0, 0.0, -9.80665)
"""m/s², in a base frame whose z axis points up."""

SMALLEST_SPREAD = 0.2
"""How far the directions of gravity must spread in two dimensions; three at right angles spread by 1."""

_AXES = {
    "+x": (1, 0, 0),
    "-x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "-y": (0, -1, 0),
    "+z": (0, 0, 1),
    "-z": (0, 0, -1),
}


def gravity_in_sensor(
    quaternions_base_sensor: ArrayLike, gravity_base: Sequence[float] = STANDARD_GRAVITY
) -> FloatArray:
    """Return gravity (n, 3), m/s², in the sensor frame.

    Parameters
    ----------
    quaternions_base_sensor : (n, 4) orientations of the sensor in the base frame, scalar first
    gravity_base : (3,) m/s², in the base frame
    """
    quaternions = np.asarray(quaternions_base_sensor, np.float64)
    return Rotation.from_quat(np.roll(quaternions, -1, axis=-1)).inv().apply(gravity_base)


def cross_matrix(vector: ArrayLike) -> FloatArray:
    """Return [v]× (3, 3), for which [v]× w = v × w."""
    x, y, z = np.asarray(vector, np.float64)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass(frozen=True, slots=True, eq=False)
class ToolLoad:
    """A tool and the bias of the sensor that carries it, sensor frame.

    Attributes
    ----------
    parameters : (10,) mass in kg, first moment m c in kg·m (3), force bias in N (3), torque bias in N·m (3)
    covariance : (10, 10) of these
    residual_std : (6,) root mean square of what the model leaves of the readings, N and N·m
    """

    parameters: FloatArray
    covariance: FloatArray
    residual_std: FloatArray

    @property
    def mass_kg(self) -> float:
        """Mass beyond the sensor's measuring plane."""
        return float(self.parameters[0])

    @property
    def mass_std_kg(self) -> float:
        """Standard deviation of the mass."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def centre_m(self) -> FloatArray:
        """Centre of mass, (3,)."""
        return self.parameters[1:4] / self.parameters[0]

    @property
    def centre_covariance(self) -> FloatArray:
        """Covariance of the centre of mass, (3, 3), m², to first order."""
        jacobian = np.column_stack([-self.centre_m, np.eye(3)]) / self.mass_kg
        return jacobian @ self.covariance[:4, :4] @ jacobian.T

    @property
    def bias(self) -> FloatArray:
        """What the sensor reads without load, (6,), N and N·m."""
        return self.parameters[4:]

    def reading(self, gravity: ArrayLike) -> FloatArray:
        """Return what tool and bias alone make the sensor read, (6,), for gravity (3,), m/s², in the sensor frame."""
        return _design(gravity) @ self.parameters

    def reading_covariance(self, gravity: ArrayLike) -> FloatArray:
        """Return the covariance (6, 6) of :meth:`reading`; add it to that of a measured reading."""
        design = _design(gravity)
        return design @ self.covariance @ design.T


def identify_tool(gravity: ArrayLike, readings: ArrayLike, readings_std: ArrayLike) -> ToolLoad:
    """Find mass, centre and bias from mean readings in several poses at rest, by weighted linear least squares.

    Parameters
    ----------
    gravity : (n, 3) in the sensor frame, m/s², from :func:`gravity_in_sensor`
    readings : (n, 6) mean readings, N and N·m
    readings_std : (6,) or (n, 6) standard deviations of those means

    Raises
    ------
    ConfigurationError
        The poses do not determine the tool; the message names a pose to add. Or the readings show no weight.
    """
    directions = np.atleast_2d(np.asarray(gravity, np.float64))
    measured = np.atleast_2d(np.asarray(readings, np.float64))
    std = np.broadcast_to(np.asarray(readings_std, np.float64), measured.shape)
    if directions.shape != (len(measured), 3) or measured.shape[1:] != (6,):
        raise ConfigurationError(
            f"tool identification: gravity {directions.shape} and readings {measured.shape} must be (n, 3) and (n, 6)"
        )
    finite = np.isfinite(directions).all() and np.isfinite(measured).all()
    if not (finite and directions.any(axis=1).all() and (std > 0).all()):
        raise ConfigurationError(
            "tool identification: gravity and readings must be finite, gravity not zero, deviations positive"
        )
    _check_poses(directions)
    design = np.array([_design(direction) for direction in directions])
    weighted = (design / std[:, :, np.newaxis]).reshape(-1, 10)
    # columns differ by orders of magnitude: they are scaled before they are inverted
    scale = np.linalg.norm(weighted, axis=0)
    inverse = np.linalg.pinv(weighted / scale) / scale[:, np.newaxis]
    parameters = inverse @ (measured / std).ravel()
    covariance = inverse @ inverse.T
    if parameters[0] < 3 * np.sqrt(covariance[0, 0]):
        raise ConfigurationError(
            f"tool identification: a mass of {parameters[0]:.4f} ± {np.sqrt(covariance[0, 0]):.4f} kg cannot be told "
            "from none; check the sign of gravity, the frames, and that a tool is mounted"
        )
    residual = measured - design @ parameters
    return ToolLoad(parameters, covariance, np.sqrt((residual**2).mean(axis=0)))


def wrench_matrix(T_a_b: Pose) -> FloatArray:
    """Return M (6, 6) that carries a wrench about the origin of b, in b's axes, to a.

    f_a = R f_b and t_a = R t_b + p × f_a; a covariance C goes to M C Mᵀ.
    """
    R = Rotation.from_quat(np.roll(T_a_b.quaternion_wxyz, -1)).as_matrix()
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = R
    matrix[3:, :3] = cross_matrix(T_a_b.position) @ R
    return matrix


def _design(gravity: ArrayLike) -> FloatArray:
    """Return the matrix (6, 10) from parameters to the reading in one pose."""
    design = np.zeros((6, 10))
    design[:3, 0] = gravity
    design[3:, 1:4] = -cross_matrix(gravity)
    design[:, 4:] = np.eye(6)
    return design


def _spread(directions: FloatArray) -> tuple[float, float]:
    """Return how far unit vectors (n, 3) spread: second and first singular value of their scatter."""
    centred = directions - directions.mean(axis=0)
    _, second, first = np.sqrt(np.abs(np.linalg.eigvalsh(centred.T @ centred))).tolist()
    return second, first


def _check_poses(gravity: FloatArray) -> None:
    """Refuse poses whose directions of gravity lie close to a line: these leave a component of the centre open."""
    directions = gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    spread, _ = _spread(directions)
    if spread < SMALLEST_SPREAD:
        raise ConfigurationError(
            f"tool identification: {len(directions)} poses do not determine weight and centre (their gravity spreads "
            f"by {spread:.2f} in two dimensions, {SMALLEST_SPREAD} is needed): add poses in which gravity points "
            f"along {' and '.join(_missing_axes(directions))} of the sensor"
        )


def _missing_axes(directions: FloatArray) -> list[str]:
    """Return the axes of the sensor along which gravity is to point in further poses, the best one first."""
    missing = []
    while _spread(directions)[0] < SMALLEST_SPREAD:
        extended = {axis: np.vstack([directions, vector]) for axis, vector in _AXES.items()}
        best = max(extended, key=lambda axis: _spread(extended[axis]))
        missing.append(best)
        directions = extended[best]
    return missing
