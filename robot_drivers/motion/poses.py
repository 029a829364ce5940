"""Rigid transformations as plain numbers: positions in m, unit quaternions with the scalar first.

Written for single poses at the 250 Hz of a robot controller, where small arrays cost more than they save.
"""

import math

from robot_drivers.protocols import Pose

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]

IDENTITY = Pose((0.0, 0.0, 0.0))

_NEARLY_PARALLEL = 0.9999995  # below 2 mrad the chord is the arc, to 1e-7 of it
_NEARLY_STILL = 1e-9  # the sine is the angle to machine precision


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the quaternion of the rotation q followed by p."""
    pw, px, py, pz = p
    qw, qx, qy, qz = q
    return (
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Return the inverse of a unit quaternion."""
    return (q[0], -q[1], -q[2], -q[3])


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Rotate the vector ``v`` by the unit quaternion ``q``."""
    w, x, y, z = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


def compose(T_a_b: Pose, T_b_c: Pose) -> Pose:
    """Return ``T_a_c``."""
    x, y, z = rotate(T_a_b.quaternion_wxyz, T_b_c.position)
    ax, ay, az = T_a_b.position
    return Pose((ax + x, ay + y, az + z), product(T_a_b.quaternion_wxyz, T_b_c.quaternion_wxyz))


def inverse(T_a_b: Pose) -> Pose:
    """Return ``T_b_a``."""
    back = conjugate(T_a_b.quaternion_wxyz)
    x, y, z = rotate(back, T_a_b.position)
    return Pose((-x, -y, -z), back)


def normalised(T_a_b: Pose) -> Pose:
    """Return the pose with its quaternion scaled to length one."""
    w, x, y, z = T_a_b.quaternion_wxyz
    length = math.sqrt(w * w + x * x + y * y + z * z)
    return Pose(T_a_b.position, (w / length, x / length, y / length, z / length))


def distance(T_base_a: Pose, T_base_b: Pose) -> tuple[float, float]:
    """Return how far two poses are apart: between the origins in m, and the angle of rotation in rad."""
    w, x, y, z = product(conjugate(T_base_a.quaternion_wxyz), T_base_b.quaternion_wxyz)
    angle = 2 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))
    return math.dist(T_base_a.position, T_base_b.position), angle


def slerp(p: Quaternion, q: Quaternion, fraction: float) -> Quaternion:
    """Return the orientation at ``fraction`` of the shortest rotation from p to q, at constant rate."""
    cosine = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3]
    if cosine < 0:
        cosine, q = -cosine, (-q[0], -q[1], -q[2], -q[3])
    if cosine > _NEARLY_PARALLEL:
        from_p, to_q = 1 - fraction, fraction
    else:
        angle = math.acos(cosine)
        from_p = math.sin((1 - fraction) * angle) / math.sin(angle)
        to_q = math.sin(fraction * angle) / math.sin(angle)
    w, x, y, z = (from_p * a + to_q * b for a, b in zip(p, q, strict=True))
    length = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / length, x / length, y / length, z / length)


def interpolate(start: Pose, end: Pose, fraction: float) -> Pose:
    """Return the pose at ``fraction`` (0 to 1) of the way: straight in position, slerp in orientation."""
    (ax, ay, az), (bx, by, bz) = start.position, end.position
    return Pose(
        (ax + fraction * (bx - ax), ay + fraction * (by - ay), az + fraction * (bz - az)),
        slerp(start.quaternion_wxyz, end.quaternion_wxyz, fraction),
    )


def rotation_vector(q: Quaternion) -> Vector:
    """Return axis times angle, rad, of the shorter of the two rotations that a unit quaternion tells."""
    w, x, y, z = q if q[0] >= 0 else (-q[0], -q[1], -q[2], -q[3])
    sine = math.sqrt(x * x + y * y + z * z)
    # angle / sine of its half, which tends to 2
    scale = 2.0 if sine < _NEARLY_STILL else 2 * math.atan2(sine, w) / sine
    return (scale * x, scale * y, scale * z)


def from_rotation_vector(vector: Vector) -> Quaternion:
    """Return the unit quaternion of a rotation about an axis by an angle, given as axis times angle, rad."""
    angle = math.sqrt(sum(part * part for part in vector))
    # sine of the half angle / angle, which tends to a half
    scale = 0.5 if angle < _NEARLY_STILL else math.sin(angle / 2) / angle
    x, y, z = vector
    return (math.cos(angle / 2), scale * x, scale * y, scale * z)


def matrix(q: Quaternion) -> Matrix:
    """Return the rotation matrix of a unit quaternion, row by row."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def about_x(angle: float) -> Quaternion:
    """Return the rotation by ``angle`` (rad) about x."""
    return (math.cos(angle / 2), math.sin(angle / 2), 0.0, 0.0)


def about_y(angle: float) -> Quaternion:
    """Return the rotation by ``angle`` (rad) about y."""
    return (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)


def about_z(angle: float) -> Quaternion:
    """Return the rotation by ``angle`` (rad) about z."""
    return (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))
