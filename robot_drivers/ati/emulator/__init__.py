"""An emulated Net F/T box, and an Ethernet Axia, that speak the same bytes as real ones."""

from robot_drivers.ati.emulator.axia import AxiaEmulator, AxiaEmulatorSettings
from robot_drivers.ati.emulator.faults import Faults, LinkCounts
from robot_drivers.ati.emulator.netft import NetFTEmulator
from robot_drivers.ati.emulator.settings import BoxConfiguration, EmulatorSettings
from robot_drivers.emulated_wrench import WrenchSource

__all__ = [
    "AxiaEmulator",
    "AxiaEmulatorSettings",
    "BoxConfiguration",
    "EmulatorSettings",
    "Faults",
    "LinkCounts",
    "NetFTEmulator",
    "WrenchSource",
]
