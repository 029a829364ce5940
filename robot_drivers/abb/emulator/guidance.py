"""EGM position guidance of the emulated controller: references in, joint motion out.

Each cycle takes one message of the PC; without one the last reference stays in force. The control law is

    speed = k (reference − position) + speed reference,    k = gain of the position correction, 1/s

with the speed low-pass filtered. No joint goes faster than ``MaxSpeedDeviation``: all are slowed alike.
"""

import math
from dataclasses import dataclass
from enum import Enum

from robot_drivers.abb.egm.codec import EgmSensor, decode_sensor
from robot_drivers.abb.emulator.arm import CYCLE_S, Arm
from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.errors import DeviceProtocolError, MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.motion.poses import Vector
from robot_drivers.protocols import Pose

NO_DATA_FROM_DEVICE = 41822
"""The controller's event "No data from the UdpUc device"."""

_STILL: Vector = (0.0, 0.0, 0.0)


class GuidanceMode(Enum):
    """What the references mean."""

    POSE = "EGMRunPose"
    JOINT = "EGMRunJoint"


class GuidanceState(Enum):
    """Where a session stands."""

    RUNNING = "running"
    CONVERGED = "converged"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class GuidanceSettings:
    """Arguments of EGMSetupUC, EGMAct and EGMRun, with the manual's defaults where it has some.

    ``position_gain`` in 1/s, ``filter_hz`` the low pass, ``max_speed_deviation`` in °/s, convergence in mm
    and °.
    """

    mode: GuidanceMode = GuidanceMode.POSE
    comm_timeout_s: float = 1.0
    cond_time_s: float = 1.0
    position_gain: float = 5.0
    filter_hz: float = 20.0
    max_speed_deviation: float = 1.0
    convergence_mm: float = 1.0
    convergence_deg: float = 0.5


class Guidance:
    """One session of guidance.

    Attributes
    ----------
    state : where it stands
    event : number of the controller's event that ended it, 0 for none
    converged : whether the reference is reached in the present cycle
    ignored : messages of the PC that were none: malformed, of the other mode, or with a number that is not
        finite
    """

    def __init__(self, settings: GuidanceSettings, arm: Arm) -> None:
        self.state = GuidanceState.RUNNING
        self.event = 0
        self.converged = False
        self.ignored = 0
        self._settings = settings
        self._arm = arm
        self._reference_pose = arm.planned
        self._reference_joints = arm.joints
        self._reference_speed: tuple[float, ...] = (0.0,) * 6
        self._speed: tuple[float, ...] = (0.0,) * 6
        self._silent_s = 0.0
        self._converged_s = 0.0

    def cycle(self, datagram: bytes | None) -> None:
        """Advance by one cycle with the next message of the PC, None if there is none."""
        if self.state is not GuidanceState.RUNNING:
            return
        self._silent_s += CYCLE_S
        if datagram is not None and self._take(datagram):
            self._silent_s = 0.0
        if self._silent_s > self._settings.comm_timeout_s:
            self.state, self.event = GuidanceState.FAILED, NO_DATA_FROM_DEVICE
            return
        try:
            self._move()
        except MotionRefusedError:
            self.state = GuidanceState.FAILED
            return
        self.converged = self._is_converged()
        self._converged_s = self._converged_s + CYCLE_S if self.converged else 0.0
        if self._converged_s >= self._settings.cond_time_s:
            self.state = GuidanceState.CONVERGED

    def _take(self, datagram: bytes) -> bool:
        try:
            sensor = decode_sensor(datagram)
            if self._settings.mode is GuidanceMode.POSE:
                self._reference_pose = _pose(sensor)
            else:
                self._reference_joints = _joints(sensor)
            self._reference_speed = _speed(sensor, self._settings.mode)
        except DeviceProtocolError:
            self.ignored += 1
            return False
        return True

    def _move(self) -> None:
        arm, gain = self._arm, self._settings.position_gain
        if self._settings.mode is GuidanceMode.JOINT:
            error: tuple[float, ...] = tuple(
                r - q for r, q in zip(self._reference_joints, arm.joints, strict=True)
            )
        else:
            error = (
                *_difference(arm.planned, self._reference_pose),
                *_turn(arm.planned, self._reference_pose),
            )
        wanted = (gain * e + v for e, v in zip(error, self._reference_speed, strict=True))
        smoothing = 1 - math.exp(-2 * math.pi * self._settings.filter_hz * CYCLE_S)
        self._speed = tuple(v + smoothing * (w - v) for v, w in zip(self._speed, wanted, strict=True))
        steps = [v * CYCLE_S for v in self._speed]
        joints: tuple[float, ...]
        if self._settings.mode is GuidanceMode.JOINT:
            joints = tuple(q + step for q, step in zip(arm.joints, steps, strict=True))
        else:
            joints = arm.joints_at(_moved(arm.planned, steps))
        arm.place_joints(self._slowed(joints))

    def _slowed(self, joints: tuple[float, ...]) -> Joints:
        """Shorten the joint steps alike, so that none is faster than MaxSpeedDeviation."""
        present = self._arm.joints
        largest = max(abs(after - before) for before, after in zip(present, joints, strict=True))
        allowed = math.radians(self._settings.max_speed_deviation) * CYCLE_S
        scale = min(1.0, allowed / largest) if largest else 1.0
        q1, q2, q3, q4, q5, q6 = (
            before + scale * (after - before) for before, after in zip(present, joints, strict=True)
        )
        return q1, q2, q3, q4, q5, q6

    def _is_converged(self) -> bool:
        degrees = self._settings.convergence_deg
        if self._settings.mode is GuidanceMode.JOINT:
            apart = zip(self._reference_joints, self._arm.joints, strict=True)
            return all(abs(math.degrees(r - q)) <= degrees for r, q in apart)
        position, angle = poses.distance(self._arm.planned, self._reference_pose)
        return position * 1e3 <= self._settings.convergence_mm and math.degrees(angle) <= degrees


def _pose(sensor: EgmSensor) -> Pose:
    cartesian = None if sensor.planned is None else sensor.planned.cartesian
    if cartesian is None or cartesian.pos is None:
        raise DeviceProtocolError("no position")
    p = cartesian.pos
    if cartesian.euler is not None:  # Euler angles win over a quaternion beside them
        e = cartesian.euler
        quaternion = poses.about_z(math.radians(e.z))
        for factor in (poses.about_y(math.radians(e.y)), poses.about_x(math.radians(e.x))):
            quaternion = poses.product(quaternion, factor)
    elif cartesian.orient is not None:
        o = cartesian.orient
        quaternion = (o.u0, o.u1, o.u2, o.u3)
    else:
        raise DeviceProtocolError("no orientation")
    if not all(map(math.isfinite, (p.x, p.y, p.z, *quaternion))) or not any(quaternion):
        raise DeviceProtocolError("no pose")
    return poses.normalised(Pose((p.x * 1e-3, p.y * 1e-3, p.z * 1e-3), quaternion))


def _joints(sensor: EgmSensor) -> Joints:
    joints = None if sensor.planned is None else sensor.planned.joints
    if joints is None or len(joints.joints) != 6 or not all(map(math.isfinite, joints.joints)):
        raise DeviceProtocolError("no six joints")
    q1, q2, q3, q4, q5, q6 = map(math.radians, joints.joints)
    return q1, q2, q3, q4, q5, q6


def _speed(sensor: EgmSensor, mode: GuidanceMode) -> tuple[float, ...]:
    """Return the speed reference in m/s and rad/s, zero where there is none."""
    reference = sensor.speed_ref
    values: tuple[float, ...] = ()
    if reference is not None and mode is GuidanceMode.POSE and reference.cartesians is not None:
        values = reference.cartesians.value
    elif reference is not None and mode is GuidanceMode.JOINT and reference.joints is not None:
        values = reference.joints.joints
    if not values:
        return (0.0,) * 6
    if len(values) != 6 or not all(map(math.isfinite, values)):
        raise DeviceProtocolError("no six speeds")
    if mode is GuidanceMode.JOINT:
        return tuple(map(math.radians, values))
    return (*(v * 1e-3 for v in values[:3]), *map(math.radians, values[3:]))


def _difference(present: Pose, reference: Pose) -> Vector:
    x, y, z = (r - p for p, r in zip(present.position, reference.position, strict=True))
    return (x, y, z)


def _turn(present: Pose, reference: Pose) -> Vector:
    """Return the rotation vector (rad, base frame) from one orientation to another, the short way."""
    w, x, y, z = poses.product(reference.quaternion_wxyz, poses.conjugate(present.quaternion_wxyz))
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-12:
        return _STILL
    scale = math.copysign(2 * math.atan2(sine, abs(w)) / sine, w)
    return (scale * x, scale * y, scale * z)


def _moved(pose: Pose, steps: list[float]) -> Pose:
    x, y, z = (p + d for p, d in zip(pose.position, steps[:3], strict=True))
    rx, ry, rz = steps[3:]
    angle = math.sqrt(rx * rx + ry * ry + rz * rz)
    scale = math.sin(angle / 2) / angle if angle else 0.5
    turned = poses.product((math.cos(angle / 2), scale * rx, scale * ry, scale * rz), pose.quaternion_wxyz)
    return poses.normalised(Pose((x, y, z), turned))
