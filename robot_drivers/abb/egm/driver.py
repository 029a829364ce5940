"""EGM Position Guidance as a driver that a rig file names."""

from robot_drivers.abb.egm.guidance import EGMGuidedRobot
from robot_drivers.abb.egm.guidance_session import EGMGuidanceSettings
from robot_drivers.abb.motion.specification import specification
from robot_drivers.driver import Driver

DRIVER = Driver(
    EGMGuidanceSettings,
    EGMGuidedRobot,
    lambda settings: specification(settings.limits, settings.T_flange_tool),
)
