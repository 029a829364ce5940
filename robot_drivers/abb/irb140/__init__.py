"""The ABB IRB 140 on an IRC5 controller, moved by the RAPID server of ``rapid/``."""

from robot_drivers.abb.irb140.driver import IRB140, IRB140Settings, MotionInterruptedError

__all__ = ["IRB140", "IRB140Settings", "MotionInterruptedError"]
