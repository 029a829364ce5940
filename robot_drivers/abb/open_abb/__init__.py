"""The ABB IRB 140 behind an open-abb server."""

from robot_drivers.abb.motion.specification import specification
from robot_drivers.abb.open_abb.driver import OpenABB, OpenABBSettings
from robot_drivers.driver import Driver

__all__ = ["DRIVER", "OpenABB", "OpenABBSettings"]

DRIVER = Driver(
    OpenABBSettings,
    OpenABB,
    lambda settings: specification(settings.limits, settings.T_flange_tool, settings.host),
)
