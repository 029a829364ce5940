"""What the drivers of the IRB 140 say of it beforehand."""

from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.protocols import Pose
from robot_drivers.specification import RobotSpecification


def specification(limits: MotionLimits, T_flange_tool: Pose, host: str = "") -> RobotSpecification:
    """Return the arm's joints within the limits that the settings give them, and the controller's tool data."""
    return RobotSpecification(
        host=host,
        joints=len(limits.joint_limits),
        joint_limits=limits.joint_limits,
        T_flange_tool=T_flange_tool,
    )
