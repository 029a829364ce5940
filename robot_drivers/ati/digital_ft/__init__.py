"""An ATI Digital F/T on RS-485: Modbus to set it up, raw gages at 7 kHz to read."""

from robot_drivers.ati.digital_ft.driver import DigitalFT, DigitalFTSettings
from robot_drivers.ati.transducer.gamma import GAGE_NOISE_STD, RATED_WRENCH
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "DigitalFT", "DigitalFTSettings"]


def _specification(settings: DigitalFTSettings) -> ForceSensorSpecification:
    """Return what the device is, a Gamma as far as is known."""
    return ForceSensorSpecification(
        rated_wrench=RATED_WRENCH, noise_std=GAGE_NOISE_STD, rate_hz=settings.sample_rate_hz
    )


DRIVER = Driver(DigitalFTSettings, DigitalFT, _specification)
