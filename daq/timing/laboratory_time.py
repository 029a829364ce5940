"""Living on the clock of an emulated laboratory, as its rig file says; never where a device is real."""

from collections.abc import Iterator
from contextlib import contextmanager
from ipaddress import ip_address
from urllib.parse import urlsplit

from daq.errors import RigError
from daq.rig import Rig
from robot_drivers.abb.irb140 import IRB140Settings
from robot_drivers.ati.netft import NetFTSettings
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.clock import living_on
from robot_drivers.errors import ConfigurationError
from robot_drivers.laboratory_clock import LaboratoryClock


@contextmanager
def in_the_time_of(rig: Rig) -> Iterator[None]:
    """Let this process live meanwhile on the clock of the rig's laboratory, where it has one of its own.

    Raises
    ------
    RigError
        A device of the rig is not on this computer, so it may be real; or the laboratory has ended.
    """
    if rig.laboratory_clock is None:
        yield
        return
    if real := _elsewhere(rig):
        raise RigError(
            f"rig {rig.name!r}: laboratory_clock is for emulated devices on this computer, and {real} is not one; "
            "remove laboratory_clock from the rig file"
        )
    try:
        clock = LaboratoryClock(rig.laboratory_clock)
    except ConfigurationError as error:
        raise RigError(f"rig {rig.name!r}: {error}") from error
    with living_on(clock):
        yield


def _elsewhere(rig: Rig) -> str:
    """Return the first device that need not be emulated, empty where all are reached by the loopback network."""
    places = {
        "force sensor": _host(rig.force_sensor.settings),
        "robot": _host(rig.robot.settings),
        **{f"camera {camera.name}": _host(camera.settings) for camera in rig.cameras},
    }
    return next((role for role, host in places.items() if not _loops_back(host)), "")


def _host(settings: object) -> str:
    """Return where a device is reached, empty where by no network."""
    match settings:
        case NetFTSettings(host=host) | IRB140Settings(host=host):
            return host
        case OpenCVCameraSettings(source=source):
            return urlsplit(source).hostname or ""
    return ""


def _loops_back(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
