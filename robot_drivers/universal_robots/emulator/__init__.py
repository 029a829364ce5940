"""An emulated controller of an e-Series arm: it speaks RTDE, and follows a reference as the servo program makes it."""

from robot_drivers.universal_robots.emulator.controller import URControllerEmulator
from robot_drivers.universal_robots.emulator.settings import UREmulatorSettings, URFaults

__all__ = ["URControllerEmulator", "UREmulatorSettings", "URFaults"]
