"""An emulated Net F/T box that speaks the same bytes as a real one."""

from robot_drivers.ati.emulator.box import WrenchSource
from robot_drivers.ati.emulator.faults import Faults, LinkCounts
from robot_drivers.ati.emulator.netft import NetFTEmulator
from robot_drivers.ati.emulator.settings import BoxConfiguration, EmulatorSettings

__all__ = ["BoxConfiguration", "EmulatorSettings", "Faults", "LinkCounts", "NetFTEmulator", "WrenchSource"]
