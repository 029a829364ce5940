"""An ATI Net F/T box on its native CAN protocol: resolved counts, polled by the host."""

from robot_drivers.ati.netbox_can.driver import NetBoxCan
from robot_drivers.ati.netbox_can.settings import NetBoxCanSettings
from robot_drivers.ati.transducer.gamma import specification
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "NetBoxCan", "NetBoxCanSettings"]


def _specification(settings: NetBoxCanSettings) -> ForceSensorSpecification:
    return specification(settings.rated_wrench, settings.rate_hz)


DRIVER = Driver(NetBoxCanSettings, NetBoxCan, _specification)
