"""Arms of Universal Robots' e-Series over RTDE: the robot, the force sensor in its flange, an emulated controller."""

from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification, RobotSpecification
from robot_drivers.universal_robots.arms import RATED_WRENCH
from robot_drivers.universal_robots.robot.driver import URRobot
from robot_drivers.universal_robots.robot.settings import URSettings
from robot_drivers.universal_robots.wrench import URWrench, URWrenchSettings

__all__ = ["ROBOT", "WRENCH", "URRobot", "URSettings", "URWrench", "URWrenchSettings"]


def _robot(settings: URSettings) -> RobotSpecification:
    limits = settings.limits.joint_limits
    return RobotSpecification(
        host=settings.host,
        joints=len(limits),
        joint_limits=limits,
        T_flange_tool=settings.T_flange_tool,
    )


def _wrench(settings: URWrenchSettings) -> ForceSensorSpecification:
    """Return range and rate; of its noise the maker says nothing, and its precision is 3.5 N on a UR5e."""
    return ForceSensorSpecification(
        host=settings.host, rated_wrench=RATED_WRENCH[settings.arm], rate_hz=settings.rate_hz
    )


ROBOT = Driver(URSettings, URRobot, _robot)
WRENCH = Driver(URWrenchSettings, URWrench, _wrench)
