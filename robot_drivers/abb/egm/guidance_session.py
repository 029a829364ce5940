"""What to answer the controller during EGM Position Guidance: one answer to each datagram, and when to give none.

The first answer of a session is the pose that the controller reported; nothing is commanded unless motors
are on and guidance runs; a new session, a stop, silence or too large a lag ends a motion, and none is taken
up again.
"""

import math
from dataclasses import dataclass, field

from robot_drivers.abb.egm.codec import (
    EgmCartesian,
    EgmHeader,
    EgmMotion,
    EgmPose,
    EgmQuaternion,
    EgmRobot,
    EgmSensor,
    EgmState,
    MciState,
    MessageType,
    MotorState,
    RapidState,
)
from robot_drivers.abb.egm.position_stream import EGMSample, EGMSettings
from robot_drivers.abb.egm.protobuf import encode
from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.errors import DeviceFaultError, MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.motion.line_interpolator import LineInterpolator
from robot_drivers.protocols import Pose, Speed

_LONGEST_STEP_S = 0.02  # of the reference, however long the gap between two datagrams was
_UINT32 = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class EGMGuidanceSettings:
    """How to guide.

    Attributes
    ----------
    egm : where the controller's datagrams come in
    limits : bounds of every motion
    T_flange_tool : the controller's tool data
    acceleration : m/s² and rad/s²
    largest_lag : distance (m) between reference and reported pose that ends a motion. The arm trails by
        speed / gain: 2 mm at 10 mm/s with the controller's default gain of 5 / s
    silence_limit_s : time without a datagram after which the session is over
    position_tolerance, angle_tolerance, settle_s : a motion is finished when the arm has been as close to
        its target (m, rad) for so long
    connect_timeout_s : how long to wait for the first datagram
    """

    egm: EGMSettings = field(default_factory=EGMSettings)
    limits: MotionLimits = field(default_factory=MotionLimits)
    T_flange_tool: Pose = poses.IDENTITY
    acceleration: Speed = field(default_factory=lambda: Speed(linear=0.1, angular=1.0))
    largest_lag: float = 0.015
    silence_limit_s: float = 0.1
    position_tolerance: float = 2e-4
    angle_tolerance: float = math.radians(0.05)
    settle_s: float = 0.05
    connect_timeout_s: float = 5.0


class GuidanceSession:
    """The reference of one controller.

    Attributes
    ----------
    reference : what moves; None while the controller does not run guidance
    target : of the motion under way, None without one
    interruption : why the last motion did not arrive, None if it did
    """

    def __init__(self, settings: EGMGuidanceSettings) -> None:
        self.reference: LineInterpolator | None = None
        self.target: Pose | None = None
        self.interruption: DeviceFaultError | None = None
        self._settings = settings
        self._session = 0
        self._answers = 0
        self._last_time_s = 0.0
        self._close_for_s = 0.0

    def begin(self, target: Pose, speed: Speed) -> None:
        """Start a motion that was checked before.

        Raises
        ------
        MotionRefusedError
            When guidance does not run, or the reference still brakes.
        """
        if self.reference is None:
            raise MotionRefusedError("guidance does not run on the controller; start it there")
        if not self.reference.resting:
            raise MotionRefusedError("the reference has not come to rest yet; hold, then resume")
        self.target, self.interruption, self._close_for_s = target, None, 0.0
        self.reference.begin(target, speed)

    def brake(self, reason: str) -> None:
        """Bring the reference to rest; a motion under way ends with ``reason``."""
        if self.reference is not None:
            self.reference.brake()
        self._interrupt(reason)

    def lapse(self, reason: str) -> None:
        """End the session; the reference begins anew where the arm will be."""
        self.reference = None
        self._interrupt(reason)

    def answer(self, sample: EGMSample, message: EgmRobot, session: int) -> bytes | None:
        """Return the answer to the newest datagram; ``session`` is the number of restarts of the stream so far."""
        if not _guides(message):
            self.lapse("the controller ended guidance; see its event log")
            return None
        if session != self._session:
            self.lapse("the controller began a new session")
            self._session = session
        if self.reference is None:
            self.reference = LineInterpolator(sample.pose, self._settings.acceleration)
            self._last_time_s = sample.device_time_s
        elapsed_s = min(max(sample.device_time_s - self._last_time_s, 0.0), _LONGEST_STEP_S)
        self._last_time_s = sample.device_time_s
        pose = self.reference.advance(elapsed_s)
        self._watch(sample, pose, elapsed_s)
        self._answers += 1
        header = EgmHeader(
            self._answers & _UINT32, round(sample.device_time_s * 1e3) & _UINT32, MessageType.CORRECTION
        )
        x, y, z = (p * 1e3 for p in pose.position)
        cartesian = EgmPose(EgmCartesian(x, y, z), EgmQuaternion(*pose.quaternion_wxyz))
        return encode(EgmSensor(header, EgmMotion(cartesian=cartesian)))

    def _watch(self, sample: EGMSample, reference: Pose, elapsed_s: float) -> None:
        """Find out whether the motion has arrived, or must end."""
        if self.target is None:
            return
        lag, _ = poses.distance(reference, sample.pose)
        if lag > self._settings.largest_lag:
            self.brake(f"the arm trails its reference by {lag * 1e3:.1f} mm")
            return
        position, angle = poses.distance(self.target, sample.pose)
        is_close = position < self._settings.position_tolerance and angle < self._settings.angle_tolerance
        self._close_for_s = self._close_for_s + elapsed_s if is_close else 0.0
        if self._close_for_s >= self._settings.settle_s:
            self.target = None

    def _interrupt(self, reason: str) -> None:
        if self.target is not None:
            self.target = None
            self.interruption = DeviceFaultError(f"the motion was stopped on its way: {reason}")


def _guides(message: EgmRobot) -> bool:
    """Whether the controller follows references: motors on, guidance running, RAPID not stopped."""
    return (
        _value(message.motor_state) == MotorState.ON
        and _value(message.mci_state) == MciState.RUNNING
        and _value(message.rapid_exec_state) != RapidState.STOPPED
    )


def _value(state: EgmState | None) -> int:
    return 0 if state is None else state.state
