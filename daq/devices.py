"""The drivers that a rig file can name: the one place where concrete devices are known.

Other installed packages add theirs by entry points that name a :class:`~robot_drivers.driver.Driver`, in the groups
``retract.force_sensors``, ``retract.robots`` and ``retract.cameras``.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, is_dataclass
from typing import Protocol

from daq.errors import RigError
from estimator.errors import InputError
from estimator.plugins import Plugin, plugins
from robot_drivers.abb.egm.guidance import EGMGuidedRobot
from robot_drivers.abb.egm.guidance_session import EGMGuidanceSettings
from robot_drivers.abb.irb140 import IRB140, IRB140Settings
from robot_drivers.abb.open_abb import OpenABB, OpenABBSettings
from robot_drivers.ati.controller_ft import ControllerFT, ControllerFTSettings
from robot_drivers.ati.digital_ft import DigitalFT, DigitalFTSettings
from robot_drivers.ati.netbox_can import NetBoxCan, NetBoxCanSettings
from robot_drivers.ati.netcanoem import NetCANOEM, NetCANOEMSettings
from robot_drivers.ati.netft import NetFT, NetFTSettings
from robot_drivers.cameras.dc1394 import DC1394Camera, DC1394CameraSettings
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.driver import Driver
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


@contextmanager
def connected(devices: Devices) -> Iterator[Devices]:
    """Connect all devices, and close them in the end. Nothing moves."""
    with ExitStack() as stack:
        for device in devices.all().values():
            stack.callback(device.close)
            device.connect()
        yield devices


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


@dataclass(frozen=True, slots=True)
class Role:
    """What a device is to a rig: in words, where its drivers are declared, and those of this project by their names."""

    words: str
    entry_points: str
    own: Mapping[str, Driver]

    def driver(self, name: str) -> Driver | None:
        """Return the driver of that name; None where there is none.

        Other packages are not asked for what this one has: a broken one stops no rig that does not need it.

        Raises
        ------
        RigError
            As :func:`installed_drivers`.
        """
        if name in self.own:
            return self.own[name]
        found = {driver.name: driver.driver for driver in installed_drivers(self)}
        return found.get(name)


FORCE_SENSOR = Role("force sensor", "retract.force_sensors", FORCE_SENSORS)
ROBOT = Role("robot", "retract.robots", ROBOTS)
CAMERA = Role("camera", "retract.cameras", CAMERAS)
ROLES = (FORCE_SENSOR, ROBOT, CAMERA)


@dataclass(frozen=True, slots=True)
class InstalledDriver:
    """A driver by its name, and the package that it is of; empty for this project's own."""

    name: str
    package: str
    driver: Driver


def installed_drivers(role: Role) -> tuple[InstalledDriver, ...]:
    """Return this project's drivers for a role, and those of other installed packages.

    Raises
    ------
    RigError
        Naming the package: what it declares cannot be imported, is no driver, or has the name of another.
    """
    try:
        return with_plugins(role, plugins(role.entry_points))
    except InputError as error:
        raise RigError(str(error)) from error


def with_plugins(role: Role, found: Iterable[Plugin]) -> tuple[InstalledDriver, ...]:
    """Return this project's drivers for a role, and those that packages declare.

    Raises
    ------
    InputError
        As :func:`installed_drivers`.
    """
    drivers = {name: InstalledDriver(name, "", driver) for name, driver in role.own.items()}
    for plugin in found:
        driver = plugin.value
        if not isinstance(driver, Driver):
            raise plugin.refused(f"names {type(driver).__name__}, which is no robot_drivers.driver.Driver")
        if not is_dataclass(driver.settings):
            raise plugin.refused(f"the settings of a driver are a dataclass, not {driver.settings!r}")
        if plugin.name in drivers:
            raise plugin.refused(f"a driver of a {role.words} is called '{plugin.name}' already")
        drivers[plugin.name] = InstalledDriver(plugin.name, plugin.package, driver)
    return tuple(drivers.values())
