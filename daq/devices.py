"""The drivers that a rig file can name: the one place where concrete devices are known."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from robot_drivers.abb.egm_guidance import EGMGuidedRobot
from robot_drivers.abb.guidance_session import EGMGuidanceSettings
from robot_drivers.abb.irb140 import IRB140, IRB140Settings
from robot_drivers.abb.open_abb import OpenABB, OpenABBSettings
from robot_drivers.ati.controller_ft import ControllerFT, ControllerFTSettings
from robot_drivers.ati.digital_ft import DigitalFT, DigitalFTSettings
from robot_drivers.ati.netbox_can import NetBoxCan, NetBoxCanSettings
from robot_drivers.ati.netcanoem import NetCANOEM, NetCANOEMSettings
from robot_drivers.ati.netft import NetFT
from robot_drivers.ati.netft_settings import NetFTSettings
from robot_drivers.cameras.dc1394 import DC1394Camera, DC1394CameraSettings
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.protocols import Camera, ForceSensor, Pose, Robot, Speed


class PathCheckingRobot(Robot, Protocol):
    """A robot that can tell beforehand whether it could follow a path."""

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        """Raise MotionRefusedError where straight lines from here through all ``targets`` break a limit."""


@dataclass(frozen=True, slots=True)
class Devices:
    """The devices of a rig; the cameras by their names, left one first."""

    force_sensor: ForceSensor
    robot: PathCheckingRobot
    cameras: Mapping[str, Camera]

    def all(self) -> dict[str, ForceSensor | Robot | Camera]:
        """Return every device by its role."""
        cameras = {f"camera {name}": camera for name, camera in self.cameras.items()}
        return {"force sensor": self.force_sensor, "robot": self.robot, **cameras}


@dataclass(frozen=True, slots=True)
class Driver:
    """A driver: the dataclass of its settings, and what makes the device from them."""

    settings: type[Any]
    make: Callable[[Any], Any]


FORCE_SENSORS: Mapping[str, Driver] = {
    "netft": Driver(NetFTSettings, NetFT),
    "netbox_can": Driver(NetBoxCanSettings, NetBoxCan),
    "netcanoem": Driver(NetCANOEMSettings, NetCANOEM),
    "digital_ft": Driver(DigitalFTSettings, DigitalFT),
    "controller_ft": Driver(ControllerFTSettings, ControllerFT),
}
ROBOTS: Mapping[str, Driver] = {
    "irb140": Driver(IRB140Settings, IRB140),
    "egm_guidance": Driver(EGMGuidanceSettings, EGMGuidedRobot),
    "open_abb": Driver(OpenABBSettings, OpenABB),
}
CAMERAS: Mapping[str, Driver] = {
    "opencv": Driver(OpenCVCameraSettings, OpenCVCamera),
    "dc1394": Driver(DC1394CameraSettings, DC1394Camera),
}
