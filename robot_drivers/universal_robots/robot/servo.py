"""Which reference the arm is sent with each of its samples, and when there is none.

A motion begins where the arm is. It ends at its target, or because the arm lags, leaves its line, passes the end of a
joint, or its program brakes; none is taken up again.
"""

from robot_drivers.errors import DeviceFaultError, MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.motion.arrival import MotionInterruptedError
from robot_drivers.motion.checks import check_on_line
from robot_drivers.motion.line_interpolator import LineInterpolator
from robot_drivers.protocols import Pose, Speed
from robot_drivers.universal_robots.robot.limits import check_joints
from robot_drivers.universal_robots.robot.registers import Doing, Order, Told
from robot_drivers.universal_robots.robot.settings import URSettings

_LONGEST_STEP_S = 0.02  # of the reference, however long the gap between two samples was


class Servo:
    """The reference of one arm.

    Attributes
    ----------
    target : of the motion under way, None without one
    interruption : why the last motion did not arrive, None if it did
    """

    def __init__(self, settings: URSettings) -> None:
        self.target: Pose | None = None
        self.interruption: DeviceFaultError | None = None
        self._settings = settings
        self._reference: LineInterpolator | None = None
        self._start: Pose | None = None
        self._last_s = 0.0
        self._close_for_s = 0.0

    @property
    def resting(self) -> bool:
        """Whether the arm is sent no reference."""
        return self._reference is None

    def begin(self, here: Pose, target: Pose, speed: Speed) -> None:
        """Start a motion from where the arm is; it was checked before.

        Raises
        ------
        MotionRefusedError
            The reference of an earlier motion still brakes.
        """
        if self._reference is not None:
            raise MotionRefusedError("the reference has not come to rest yet; hold, then resume")
        self._reference = LineInterpolator(here, self._settings.acceleration)
        self._reference.begin(target, speed)
        self._start, self.target, self.interruption, self._close_for_s = here, target, None, 0.0

    def brake(self, reason: str, reached: Pose) -> None:
        """Bring the reference to rest on the line; a motion under way ends with ``reason``."""
        if self._reference is not None:
            self._reference.brake()
        if self.target is not None:
            self.target = None
            self.interruption = MotionInterruptedError(
                f"the motion was stopped on its way: {reason}", reached
            )

    def next(self, time_s: float, told: Told) -> tuple[Order, Pose]:
        """Return what to ask for, and the reference, at a sample of the controller's clock."""
        elapsed_s = min(max(time_s - self._last_s, 0.0), _LONGEST_STEP_S)
        self._last_s = time_s
        if self._reference is None:
            return Order.STAND, told.T_base_tool
        pose = self._reference.advance(elapsed_s)
        if trouble := told.trouble or self._trouble_under_way(pose, told):
            self.brake(trouble, told.T_base_tool)
        self._watch_arrival(elapsed_s, told)
        if told.trouble or told.doing in (Doing.SILENCE, Doing.JUMP):
            self._reference = None  # the arm has braked by itself, and does not follow to an end
        elif self.target is None and self._reference.resting:
            self._reference = None
        return (Order.STAND if self._reference is None else Order.FOLLOW), pose

    def _trouble_under_way(self, reference: Pose, told: Told) -> str:
        """Return why a motion must end; empty where it need not."""
        settings = self._settings
        if self.target is None or self._start is None:
            return ""
        if told.doing in (Doing.SILENCE, Doing.JUMP):
            return f"the servo program has braked by itself ({Doing(told.doing).name.lower()})"
        lag, _ = poses.distance(reference, told.T_base_tool)
        if lag > settings.largest_lag:
            return f"the arm trails its reference by {lag * 1e3:.1f} mm"
        try:
            check_joints(settings.limits, told.joints)
            check_on_line(settings.limits, self._start, self.target, told.T_base_tool)
        except DeviceFaultError as fault:
            return str(fault)
        return ""

    def _watch_arrival(self, elapsed_s: float, told: Told) -> None:
        if self.target is None:
            return
        position, angle = poses.distance(self.target, told.T_base_tool)
        settings = self._settings
        close = position < settings.position_tolerance and angle < settings.angle_tolerance
        self._close_for_s = self._close_for_s + elapsed_s if close else 0.0
        if self._close_for_s >= settings.settle_s:
            self.target = None
