"""How to reach an arm and what it may do."""

import math
from dataclasses import dataclass, field

from robot_drivers.errors import ConfigurationError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose, Speed
from robot_drivers.setting_checks import check_positive
from robot_drivers.universal_robots.arms import Arm
from robot_drivers.universal_robots.robot.limits import URLimits


@dataclass(frozen=True, slots=True)
class URSettings:
    """How to reach the robot and what it may do.

    Attributes
    ----------
    host, port : of the controller
    arm : which arm it is
    rate_hz : of its samples, and of the references that it is sent; 500 at most, 125 is enough
    limits : bounds of every motion
    T_flange_tool : the tool centre point of the installation, checked against it on connect
    acceleration : m/s² and rad/s² of the reference
    largest_lag : distance (m) between reference and arm that ends a motion
    silence_limit_s : without a sample for so long, the controller counts as lost and a motion ends
    position_tolerance, angle_tolerance, settle_s : a motion is finished when the arm has been as close to its target
        (m, rad) for so long
    connect_timeout_s : longest wait for an answer
    serial : of the arm, for the record; RTDE does not tell it
    """

    host: str
    port: int = 30004
    arm: Arm = "UR5e"
    rate_hz: float = 500.0
    limits: URLimits = field(default_factory=URLimits)
    T_flange_tool: Pose = poses.IDENTITY
    acceleration: Speed = field(default_factory=lambda: Speed(linear=0.1, angular=1.0))
    largest_lag: float = 0.015
    silence_limit_s: float = 0.25
    position_tolerance: float = 1e-4
    angle_tolerance: float = math.radians(0.05)
    settle_s: float = 0.1
    connect_timeout_s: float = 3.0
    serial: str = "not told"

    def __post_init__(self) -> None:
        if not 10 <= self.rate_hz <= 500:
            raise ConfigurationError(f"UR rate_hz {self.rate_hz}: must be 10 to 500")
        check_positive(self, "UR", "largest_lag", "silence_limit_s", "settle_s", "connect_timeout_s")
