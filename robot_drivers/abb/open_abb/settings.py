"""How to reach a robot behind an open-abb server, and what it may do."""

import math
from dataclasses import dataclass, field

from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.errors import ConfigurationError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose
from robot_drivers.setting_checks import check_positive


@dataclass(frozen=True, slots=True)
class OpenABBSettings:
    """How to reach the robot and what it may do.

    Attributes
    ----------
    host, port : of the server
    limits : bounds of every motion
    T_flange_tool : sent to the controller as tool frame on connect, and checked against what it reports then
    stop_within_s : longest part of a motion that cannot be stopped; the shorter, the more often the tool stands
    poll_period_s : time between two poses read while the tool stands
    position_decimals : decimals of the positions sent, in mm
    position_tolerance, angle_tolerance : how far from its target (m, rad) a finished motion may stand; the reported
        orientation has steps of 0.1°
    connect_timeout_s, reply_timeout_s : longest waits
    reply_gap_s : silence after which a reply counts as whole; nothing else marks its end
    """

    host: str
    port: int = 5000
    limits: MotionLimits = field(default_factory=MotionLimits)
    T_flange_tool: Pose = poses.IDENTITY
    stop_within_s: float = 0.5
    poll_period_s: float = 0.05
    position_decimals: int = 3
    position_tolerance: float = 2e-4
    angle_tolerance: float = math.radians(0.3)
    connect_timeout_s: float = 3.0
    reply_timeout_s: float = 2.0
    reply_gap_s: float = 0.02

    def __post_init__(self) -> None:
        check_positive(
            self,
            "open-abb",
            "stop_within_s",
            "poll_period_s",
            "connect_timeout_s",
            "reply_timeout_s",
            "reply_gap_s",
        )
        if not 1 <= self.position_decimals <= 3:
            raise ConfigurationError(f"open-abb position_decimals {self.position_decimals}: must be 1..3")
