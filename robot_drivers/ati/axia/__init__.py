"""An ATI Ethernet Axia: a force/torque sensor with its electronics in it, on RDT over UDP and web pages."""

from robot_drivers.ati.axia.driver import Axia
from robot_drivers.ati.axia.settings import AxiaSettings
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "Axia", "AxiaSettings"]


def _specification(settings: AxiaSettings) -> ForceSensorSpecification:
    """Return what the rig file says of the device; its noise is not known."""
    return ForceSensorSpecification(
        host=settings.host, rated_wrench=settings.rated_wrench, rate_hz=settings.rate_hz
    )


DRIVER = Driver(AxiaSettings, Axia, _specification)
