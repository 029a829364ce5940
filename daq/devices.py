"""The drivers that a rig file can name: the one place where concrete devices are known.

Other installed packages add theirs by entry points that name a :class:`~robot_drivers.driver.Driver`, in the groups
``retract.force_sensors``, ``retract.robots`` and ``retract.cameras``.
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, is_dataclass
from typing import Generic, TypeVar

from daq.errors import RigError
from estimator.errors import InputError
from estimator.plugins import Plugin, plugins
from robot_drivers import bota, genicam, universal_robots
from robot_drivers.abb import irb140, open_abb
from robot_drivers.abb.egm import driver as egm
from robot_drivers.ati import axia, controller_ft, digital_ft, netbox_can, netcanoem, netft
from robot_drivers.cameras import dc1394, opencv
from robot_drivers.driver import Driver
from robot_drivers.protocols import Camera, ForceSensor, Robot
from robot_drivers.specification import CameraSpecification, ForceSensorSpecification, RobotSpecification

MOST_CAMERAS = 4


@dataclass(frozen=True, slots=True)
class Devices:
    """The devices of a rig; one to four cameras by their names, the first two those of the stereo pair, left first."""

    force_sensor: ForceSensor
    robot: Robot
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
    "netft": netft.DRIVER,
    "axia": axia.DRIVER,
    "netbox_can": netbox_can.DRIVER,
    "netcanoem": netcanoem.DRIVER,
    "digital_ft": digital_ft.DRIVER,
    "controller_ft": controller_ft.DRIVER,
    "bota": bota.DRIVER,
    "ur_flange": universal_robots.WRENCH,
}
ROBOTS: Mapping[str, Driver] = {
    "irb140": irb140.DRIVER,
    "egm_guidance": egm.DRIVER,
    "open_abb": open_abb.DRIVER,
    "ur_rtde": universal_robots.ROBOT,
}
CAMERAS: Mapping[str, Driver] = {
    "opencv": opencv.DRIVER,
    "dc1394": dc1394.DRIVER,
    "genicam": genicam.DRIVER,
}

S = TypeVar("S", ForceSensorSpecification, RobotSpecification, CameraSpecification)


@dataclass(frozen=True, slots=True)
class Role(Generic[S]):
    """What a device is to a rig.

    Attributes
    ----------
    words : in words
    entry_points : group in which packages declare its drivers
    own : this project's drivers by their names
    unspecified : what is known of a device whose driver says nothing
    """

    words: str
    entry_points: str
    own: Mapping[str, Driver]
    unspecified: S

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

    def named(self, name: str) -> Driver:
        """Return the driver of that name.

        Raises
        ------
        RigError
            There is none, or as :func:`installed_drivers`.
        """
        driver = self.driver(name)
        if driver is None:
            raise RigError(f"no driver of a {self.words} is called '{name}'; {self.to_choose_from()}")
        return driver

    def to_choose_from(self) -> str:
        """Return the names of the installed drivers, in words."""
        return f"one of {', '.join(repr(one.name) for one in installed_drivers(self))}"

    def specification(self, name: str, settings: object) -> S:
        """Return what the driver of that name says of the device that these settings describe.

        Raises
        ------
        RigError
            As :meth:`named`; or what the driver says cannot be right.
        """
        driver = self.named(name)
        if driver.specify is None:
            return self.unspecified
        try:
            found = driver.specify(settings)
        except ValueError as error:
            raise RigError(
                f"driver '{name}' of a {self.words}: {error}; correct its settings, or its package"
            ) from error
        if not isinstance(found, type(self.unspecified)):
            raise RigError(
                f"driver '{name}' of a {self.words}: its specification is a {type(found).__name__}, not a "
                f"{type(self.unspecified).__name__}; repair its package"
            )
        return found


FORCE_SENSOR = Role("force sensor", "retract.force_sensors", FORCE_SENSORS, ForceSensorSpecification())
ROBOT = Role("robot", "retract.robots", ROBOTS, RobotSpecification())
CAMERA = Role("camera", "retract.cameras", CAMERAS, CameraSpecification())
AnyRole = Role[ForceSensorSpecification] | Role[RobotSpecification] | Role[CameraSpecification]
ROLES: tuple[AnyRole, ...] = (FORCE_SENSOR, ROBOT, CAMERA)


@dataclass(frozen=True, slots=True)
class InstalledDriver:
    """A driver by its name, and the package that it is of; empty for this project's own."""

    name: str
    package: str
    driver: Driver


def installed_drivers(role: AnyRole) -> tuple[InstalledDriver, ...]:
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


def with_plugins(role: AnyRole, found: Iterable[Plugin]) -> tuple[InstalledDriver, ...]:
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
