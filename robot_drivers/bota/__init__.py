"""A Bota Systems force/torque sensor on a serial line."""

from robot_drivers.bota.driver import BotaSerial
from robot_drivers.bota.settings import BotaSettings
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "BotaSerial", "BotaSettings"]


def _specification(settings: BotaSettings) -> ForceSensorSpecification:
    """Return what the rig file says of the device; its noise depends on its model and filter, and is not known."""
    return ForceSensorSpecification(rated_wrench=settings.rated_wrench, rate_hz=settings.rate_hz)


DRIVER = Driver(BotaSettings, BotaSerial, _specification)
