"""Closed-form kinematics of the IRB 140: five lengths, a spherical wrist, ABB's joint angles.

At zero the upper arm stands up and the forearm points along +x of the base frame. Axis 1 turns about z,
axes 2 and 3 about y, axis 4 about the forearm, axis 5 about y, axis 6 about the flange normal. With the
wrist centre c and φ = q2 + q3:

    c_r = 0.070 + 0.360 sin q2 + 0.380 cos φ        (distance from axis 1)
    c_z = 0.352 + 0.360 cos q2 − 0.380 sin φ
    R   = Rz(q1) Ry(φ) Rx(q4) Ry(q5) Rx(q6) Ry(90°),    flange = c + 0.065 R e_z

The last factor turns the frame so that z points out of the flange (ABB's tool0). The lengths agree in three
independent models (ARTE, robotkinematicscatalogue, several URDFs). Lengths in m, angles in rad.
"""

import math
from collections.abc import Iterator

from robot_drivers.errors import MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose

Joints = tuple[float, float, float, float, float, float]

BASE_TO_AXIS_2_Z = 0.352
AXIS_1_TO_AXIS_2_X = 0.070
UPPER_ARM = 0.360
FOREARM = 0.380
WRIST_TO_FLANGE = 0.065

# From third-party models, two or more agreeing on each; ABB's own specification was not at hand. For axis 5
# some say ±120°, the narrower range is taken. The controller's MOC.cfg holds the real ones.
JOINT_LIMITS_DEG: tuple[tuple[float, float], ...] = (
    (-180.0, 180.0),
    (-90.0, 110.0),
    (-230.0, 50.0),
    (-200.0, 200.0),
    (-115.0, 115.0),
    (-400.0, 400.0),
)
JOINT_SPEEDS_DEG_S = (200.0, 200.0, 260.0, 360.0, 360.0, 450.0)

JOINT_LIMITS = tuple((math.radians(low), math.radians(high)) for low, high in JOINT_LIMITS_DEG)
JOINT_SPEEDS = tuple(math.radians(speed) for speed in JOINT_SPEEDS_DEG_S)

_TURN = 2 * math.pi
_WRIST_ALIGNED = 1e-9


def forward(joints: Joints) -> Pose:
    """Return ``T_base_flange`` (ABB's tool0) of the joint angles."""
    q1, q2, q3, q4, q5, q6 = joints
    pitch = q2 + q3
    radius = AXIS_1_TO_AXIS_2_X + UPPER_ARM * math.sin(q2) + FOREARM * math.cos(pitch)
    height = BASE_TO_AXIS_2_Z + UPPER_ARM * math.cos(q2) - FOREARM * math.sin(pitch)
    orientation = poses.product(poses.about_z(q1), poses.about_y(pitch))
    for factor in (poses.about_x(q4), poses.about_y(q5), poses.about_x(q6), poses.about_y(math.pi / 2)):
        orientation = poses.product(orientation, factor)
    nx, ny, nz = poses.rotate(orientation, (0.0, 0.0, WRIST_TO_FLANGE))
    return Pose((radius * math.cos(q1) + nx, radius * math.sin(q1) + ny, height + nz), orientation)


def inverse(T_base_flange: Pose, near: Joints) -> list[Joints]:
    """Return every way to reach a pose, the one nearest to ``near`` first.

    Joint limits are left to the caller. Each angle is the turn (modulo 360°) nearest to that of ``near``,
    so that a path stays continuous beyond ±180°. Where the wrist is aligned (q5 = 0), q4 is that of
    ``near``.

    Returns
    -------
    Up to eight solutions (shoulder, elbow, wrist); empty where the wrist centre is out of reach.
    """
    rotation = poses.matrix(T_base_flange.quaternion_wxyz)
    x, y, z = (p - WRIST_TO_FLANGE * row[2] for p, row in zip(T_base_flange.position, rotation, strict=True))
    solutions = [
        _nearest_turns((q1, q2, q3, *wrist), near)
        for q1, q2, q3 in _arm_angles(x, y, z)
        for wrist in _wrist_angles(rotation, q1, q2 + q3, near[3])
    ]
    return sorted(solutions, key=lambda joints: _squared_distance(joints, near))


def inverse_continuous(T_base_flange: Pose, near: Joints) -> Joints:
    """Return the solution that continues the configuration of ``near``.

    Raises
    ------
    MotionRefusedError
        When the pose is out of reach.
    """
    solutions = inverse(T_base_flange, near)
    if not solutions:
        x, y, z = T_base_flange.position
        raise MotionRefusedError(f"flange position ({x:.4f}, {y:.4f}, {z:.4f}) m is out of reach of the arm")
    return solutions[0]


def singularity_angle(joints: Joints) -> float:
    """Return how far axis 5 is from the wrist singularity (axes 4 and 6 in line), rad."""
    return abs(math.remainder(joints[4], math.pi))


def _arm_angles(x: float, y: float, z: float) -> Iterator[tuple[float, float, float]]:
    """Angles 1 to 3 that bring the wrist centre to (x, y, z)."""
    height = z - BASE_TO_AXIS_2_Z
    for q1, reach in ((math.atan2(y, x), math.hypot(x, y)), (math.atan2(-y, -x), -math.hypot(x, y))):
        radius = reach - AXIS_1_TO_AXIS_2_X
        sine = (UPPER_ARM**2 + FOREARM**2 - radius**2 - height**2) / (2 * UPPER_ARM * FOREARM)
        if abs(sine) > 1:
            continue
        for q3 in (math.asin(sine), -math.pi - math.asin(sine)):
            along = UPPER_ARM - FOREARM * math.sin(q3)
            across = FOREARM * math.cos(q3)
            q2 = math.atan2(along * radius - across * height, across * radius + along * height)
            yield q1, q2, q3


def _wrist_angles(
    rotation: poses.Matrix, q1: float, pitch: float, q4_near: float
) -> Iterator[tuple[float, float, float]]:
    """Angles 4 to 6: R = Rz(q1) Ry(pitch) [Rx(q4) Ry(q5) Rx(q6)] Ry(90°), solved for the bracket M."""
    c1, s1, cp, sp = math.cos(q1), math.sin(q1), math.cos(pitch), math.sin(pitch)
    # columns of R Ry(−90°): its x axis is R's z, its z axis is minus R's x
    normal = tuple(row[2] for row in rotation)
    side = tuple(row[1] for row in rotation)
    down = tuple(-row[0] for row in rotation)

    def forearm(v: tuple[float, ...]) -> tuple[float, float, float]:
        radial, vertical = c1 * v[0] + s1 * v[1], v[2]
        return cp * radial - sp * vertical, -s1 * v[0] + c1 * v[1], sp * radial + cp * vertical

    m00, m10, m20 = forearm(normal)
    m01, _, m21 = forearm(side)
    m02, _, m22 = forearm(down)
    bend = math.hypot(m01, m02)
    if bend < _WRIST_ALIGNED:
        sign = math.copysign(1.0, m00)
        yield q4_near, math.acos(sign), sign * (math.atan2(m21, sign * m22) - q4_near)
        return
    for sign in (1.0, -1.0):
        yield (
            math.atan2(sign * m10, -sign * m20),
            math.atan2(sign * bend, m00),
            math.atan2(sign * m01, sign * m02),
        )


def _nearest_turns(joints: Joints, near: Joints) -> Joints:
    q1, q2, q3, q4, q5, q6 = (q + _TURN * round((n - q) / _TURN) for q, n in zip(joints, near, strict=True))
    return q1, q2, q3, q4, q5, q6


def _squared_distance(joints: Joints, near: Joints) -> float:
    return sum((q - n) ** 2 for q, n in zip(joints, near, strict=True))
