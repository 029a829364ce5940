"""Whether the controller and this computer mean the same by "tool"."""

import math

from robot_drivers.abb.motion import kinematics
from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.errors import ConfigurationError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose

SAME_POSITION = 0.005
"""m; reported poses further apart mean different frames."""
SAME_ANGLE = math.radians(2.0)
"""rad; the same for angles."""


def check_tool_data(T_flange_tool: Pose, joints: Joints, T_base_tool: Pose) -> None:
    """Refuse a controller whose tool pose does not follow from its joints: joint limits would be checked wrongly.

    Raises
    ------
    ConfigurationError
        Naming the tool data that the controller seems to have.
    """
    flange = kinematics.forward(joints)
    position, angle = poses.distance(poses.compose(flange, T_flange_tool), T_base_tool)
    if position > SAME_POSITION or angle > SAME_ANGLE:
        reported = poses.compose(poses.inverse(flange), T_base_tool)
        raise ConfigurationError(
            f"the controller's tool is {position * 1e3:.1f} mm and {math.degrees(angle):.1f}° from where "
            f"T_flange_tool puts it; from its joints the tool data would be {reported.position} m, "
            f"{reported.quaternion_wxyz}. Correct T_flange_tool, the tool data, or a base frame that was moved"
        )
