"""The ABB IRB 140 on an IRC5 controller, moved by the RAPID server of ``rapid/``."""

from robot_drivers.abb.irb140.driver import IRB140, IRB140Settings, MotionInterruptedError
from robot_drivers.abb.motion.specification import specification
from robot_drivers.driver import Driver

__all__ = ["DRIVER", "IRB140", "IRB140Settings", "MotionInterruptedError"]

DRIVER = Driver(
    IRB140Settings,
    IRB140,
    lambda settings: specification(settings.limits, settings.T_flange_tool, settings.host),
)
