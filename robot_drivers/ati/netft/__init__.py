"""An ATI Net F/T box: RDT over UDP, a command interface over TCP, web pages."""

from robot_drivers.ati.netft.driver import NetFT
from robot_drivers.ati.netft.settings import NetFTSettings
from robot_drivers.ati.transducer.gamma import noise_std
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "NetFT", "NetFTSettings"]


def _specification(settings: NetFTSettings) -> ForceSensorSpecification:
    """Return what the device is, with the noise that a Gamma has in its range."""
    return ForceSensorSpecification(
        host=settings.host,
        rated_wrench=settings.rated_wrench,
        noise_std=noise_std(settings.rated_wrench),
        rate_hz=settings.rate_hz,
    )


DRIVER = Driver(NetFTSettings, NetFT, _specification)
