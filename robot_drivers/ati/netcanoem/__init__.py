"""An ATI NETCANOEM board: strain gages over CAN, polled and resolved by the host."""

from robot_drivers.ati.netcanoem.driver import NetCANOEM
from robot_drivers.ati.netcanoem.settings import NetCANOEMSettings
from robot_drivers.ati.transducer.gamma import specification
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "NetCANOEM", "NetCANOEMSettings"]


def _specification(settings: NetCANOEMSettings) -> ForceSensorSpecification:
    return specification(settings.rated_wrench, settings.rate_hz)


DRIVER = Driver(NetCANOEMSettings, NetCANOEM, _specification)
