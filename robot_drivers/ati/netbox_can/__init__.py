"""An ATI Net F/T box on its native CAN protocol: resolved counts, polled by the host."""

from robot_drivers.ati.netbox_can.driver import NetBoxCan
from robot_drivers.ati.netbox_can.settings import NetBoxCanSettings
from robot_drivers.ati.transducer.gamma import noise_std
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "NetBoxCan", "NetBoxCanSettings"]


def _specification(settings: NetBoxCanSettings) -> ForceSensorSpecification:
    """Return what the device is, with the noise that a Gamma has in its range."""
    return ForceSensorSpecification(
        rated_wrench=settings.rated_wrench,
        noise_std=noise_std(settings.rated_wrench),
        rate_hz=settings.rate_hz,
    )


DRIVER = Driver(NetBoxCanSettings, NetBoxCan, _specification)
