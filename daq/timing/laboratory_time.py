"""Living on the clock of an emulated laboratory, as its rig file says; never where a device is real."""

from collections.abc import Iterator
from contextlib import contextmanager
from ipaddress import ip_address

from daq.errors import RigError
from daq.rig import Rig
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
    cameras = rig.camera_specifications()
    places = {
        "force sensor": rig.force_sensor_specification().host,
        "robot": rig.robot_specification().host,
        **{f"camera {name}": specification.host for name, specification in cameras.items()},
    }
    return next((role for role, host in places.items() if not _loops_back(host)), "")


def _loops_back(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
