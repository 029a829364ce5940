"""How a motion ended: at its target, beside it, or on the way."""

import math

from robot_drivers.errors import DeviceFaultError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose


class MotionInterruptedError(DeviceFaultError):
    """A motion that began and did not arrive; ``reached`` is the reported ``T_base_tool``."""

    def __init__(self, message: str, reached: Pose) -> None:
        super().__init__(message)
        self.reached = reached


def check_arrival(target: Pose, reached: Pose, position_tolerance: float, angle_tolerance: float) -> None:
    """Check that a tool said to have arrived stands at its target, to m and rad.

    Raises
    ------
    DeviceFaultError
        When it does not.
    """
    position_error, angle_error = poses.distance(target, reached)
    if position_error > position_tolerance or angle_error > angle_tolerance:
        raise DeviceFaultError(
            f"the tool stands {position_error * 1e3:.3f} mm and {math.degrees(angle_error):.3f}° "
            "off its target although the controller reports arrival; check load and tool data"
        )
