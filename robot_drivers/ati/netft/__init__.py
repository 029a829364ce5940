"""An ATI Net F/T box: RDT over UDP, a command interface over TCP, web pages."""

from robot_drivers.ati.netft.driver import NetFT
from robot_drivers.ati.netft.settings import NetFTSettings
from robot_drivers.ati.transducer.gamma import specification
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "NetFT", "NetFTSettings"]


def _specification(settings: NetFTSettings) -> ForceSensorSpecification:
    return specification(settings.rated_wrench, settings.rate_hz, settings.host)


DRIVER = Driver(NetFTSettings, NetFT, _specification)
