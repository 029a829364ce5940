"""An ATI NETCANOEM board: strain gages over CAN, polled and resolved by the host."""

from robot_drivers.ati.netcanoem.driver import NetCANOEM
from robot_drivers.ati.netcanoem.settings import NetCANOEMSettings
from robot_drivers.ati.transducer.gamma import noise_std
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "NetCANOEM", "NetCANOEMSettings"]


def _specification(settings: NetCANOEMSettings) -> ForceSensorSpecification:
    """Return what the device is, with the noise that a Gamma has in its range."""
    return ForceSensorSpecification(
        rated_wrench=settings.rated_wrench,
        noise_std=noise_std(settings.rated_wrench),
        rate_hz=settings.rate_hz,
    )


DRIVER = Driver(NetCANOEMSettings, NetCANOEM, _specification)
