"""The emulated arm: straight lines at trapezoidal speed, joint angles, and what the encoders read."""

import math
import random
import struct
from dataclasses import dataclass
from enum import Enum

from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.abb.motion import kinematics
from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.errors import MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.motion.poses import Vector
from robot_drivers.protocols import Pose

CYCLE_S = 0.004032

_SINGULAR_RAD = math.radians(0.5)
_LARGEST_JOINT_STEP = math.radians(10.0)
_READING = struct.Struct("<13f")


class Motion(Enum):
    """What the arm is doing, or how its last motion ended."""

    STANDING = "standing"
    MOVING = "moving"
    ARRIVED = "arrived"
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Reading:
    """What the controller reports: mm, degrees, in float32 steps."""

    position_mm: Vector
    quaternion_wxyz: poses.Quaternion
    joints_deg: Joints


@dataclass(slots=True)
class _Line:
    """A motion under way; ``done`` is the part of the way behind it, ``rate`` its derivative."""

    start: Pose
    target: Pose
    top_rate: float
    acceleration: float
    start_offset: Vector
    end_offset: Vector
    done: float = 0.0
    rate: float = 0.0
    braking: bool = False


class Arm:
    """An IRB 140 in straight-line motion, advanced cycle by cycle."""

    def __init__(self, settings: ArmSettings) -> None:
        self._settings = settings
        self._random = random.Random(settings.seed)
        self._T_tool_flange = poses.inverse(settings.T_flange_tool)
        self._line: _Line | None = None
        self._offset: Vector = (0.0, 0.0, 0.0)
        self.motion = Motion.STANDING
        self.planned = settings.home
        self.actual = settings.home
        self.joints = kinematics.inverse_continuous(
            poses.compose(settings.home, self._T_tool_flange), settings.home_joints_near
        )

    @property
    def fraction_done(self) -> float:
        """The part of the present line that is behind the tool; 0 while it stands."""
        return 0.0 if self._line is None else self._line.done

    def start_line(
        self, target: Pose, linear_speed: float, angular_speed: float, landing_offset: Vector
    ) -> None:
        """Begin a straight line; speeds in m/s and rad/s, ``landing_offset`` (m) is added to its end."""
        x, y, z = (p + o for p, o in zip(target.position, landing_offset, strict=True))
        target = Pose((x, y, z), target.quaternion_wxyz)
        length, angle = poses.distance(self.planned, target)
        s = self._settings
        self._line = _Line(
            start=self.planned,
            target=target,
            top_rate=min(linear_speed / max(length, 1e-9), angular_speed / max(angle, 1e-9)),
            acceleration=min(
                s.linear_acceleration / max(length, 1e-9), s.angular_acceleration / max(angle, 1e-9)
            ),
            start_offset=self._offset,
            end_offset=self._draw_offset(),
        )
        self.motion = Motion.MOVING

    def stop(self) -> None:
        """Brake hard on the line."""
        if self._line is not None:
            self._line.braking = True

    def halt(self) -> None:
        """Stand at once, as the brakes make it when power is lost."""
        self._line, self.motion = None, Motion.STANDING

    def step(self) -> None:
        """Advance by one cycle."""
        line = self._line
        if line is None:
            return
        self._advance(line)
        fraction = line.done
        try:
            self.place(poses.interpolate(line.start, line.target, fraction))
        except MotionRefusedError:
            self._line, self.motion = None, Motion.FAILED
            return
        self._offset = _blend(line.start_offset, line.end_offset, fraction)
        self.actual = _shifted(self.planned, self._offset)
        if fraction == 1.0:
            self._line, self.motion = None, Motion.ARRIVED
        elif line.braking and line.rate == 0.0:
            self._line, self.motion = None, Motion.STOPPED

    def joints_at(self, pose: Pose) -> Joints:
        """Return the joint angles for a nearby pose; raises MotionRefusedError out of reach."""
        return kinematics.inverse_continuous(poses.compose(pose, self._T_tool_flange), self.joints)

    def place(self, pose: Pose) -> None:
        """Put the tool at a nearby pose.

        Raises
        ------
        MotionRefusedError
            When the arm cannot follow (reach, a joint's range, the wrist singularity); it stays where it is.
        """
        self._place(pose, self.joints_at(pose))

    def place_joints(self, joints: Joints) -> None:
        """Put the joints at nearby angles; raises as :meth:`place` does."""
        flange = kinematics.forward(joints)
        self._place(poses.normalised(poses.compose(flange, self._settings.T_flange_tool)), joints)

    def measure(self) -> Reading:
        """Read the encoders: the planned joints with noise, and the pose they give."""
        noise = self._settings.encoder_noise_std
        q1, q2, q3, q4, q5, q6 = (q + self._random.gauss(0.0, noise) for q in self.joints)
        return self._report((q1, q2, q3, q4, q5, q6))

    def reference(self) -> Reading:
        """Report the planned joints and pose."""
        return self._report(self.joints)

    def _place(self, pose: Pose, joints: Joints) -> None:
        within = all(low <= q <= high for q, (low, high) in zip(joints, kinematics.JOINT_LIMITS, strict=True))
        steps = (abs(after - before) for before, after in zip(self.joints, joints, strict=True))
        singular = kinematics.singularity_angle(joints) < _SINGULAR_RAD
        if not within or singular or max(steps) > _LARGEST_JOINT_STEP:
            raise MotionRefusedError("joint out of range or close to a singularity")
        self.planned, self.joints = pose, joints
        self.actual = _shifted(pose, self._offset)

    def _report(self, joints: Joints) -> Reading:
        T_base_tool = poses.compose(kinematics.forward(joints), self._settings.T_flange_tool)
        x, y, z = T_base_tool.position
        numbers = _READING.unpack(
            _READING.pack(x * 1e3, y * 1e3, z * 1e3, *T_base_tool.quaternion_wxyz, *map(math.degrees, joints))
        )
        return Reading(numbers[:3], numbers[3:7], numbers[7:])

    def _advance(self, line: _Line) -> None:
        if line.braking:
            slowdown = self._settings.stop_factor * line.acceleration * CYCLE_S
            line.rate = max(line.rate - slowdown, 0.0)
            line.done = min(line.done + line.rate * CYCLE_S, 1.0)
            return
        rest = 1.0 - line.done
        step = line.acceleration * CYCLE_S
        braking_rate = math.sqrt(step * step / 4 + 2 * line.acceleration * rest) - step / 2
        line.rate = min(line.rate + step, line.top_rate, braking_rate)
        line.done = 1.0 if line.rate * CYCLE_S >= rest else line.done + line.rate * CYCLE_S

    def _draw_offset(self) -> Vector:
        std = self._settings.repeatability_std
        return (self._random.gauss(0.0, std), self._random.gauss(0.0, std), self._random.gauss(0.0, std))


def _blend(start: Vector, end: Vector, fraction: float) -> Vector:
    x, y, z = (a + fraction * (b - a) for a, b in zip(start, end, strict=True))
    return (x, y, z)


def _shifted(pose: Pose, offset: Vector) -> Pose:
    x, y, z = (p + o for p, o in zip(pose.position, offset, strict=True))
    return Pose((x, y, z), pose.quaternion_wxyz)
