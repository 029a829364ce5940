"""An emulated GigE Vision camera with a GenICam description of its own."""

from robot_drivers.genicam.emulator.camera import GigECameraEmulator
from robot_drivers.genicam.emulator.settings import GigECameraSettings, GigEDepthSettings, GigEFaults

__all__ = ["GigECameraEmulator", "GigECameraSettings", "GigEDepthSettings", "GigEFaults"]
