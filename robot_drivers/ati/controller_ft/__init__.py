"""A stand-alone ATI F/T Controller (CTL) on RS-232, which resolves the wrench and streams counts."""

from robot_drivers.ati.controller_ft.driver import ControllerFT, ControllerFTSettings
from robot_drivers.ati.transducer.gamma import noise_std
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "ControllerFT", "ControllerFTSettings"]


def _specification(settings: ControllerFTSettings) -> ForceSensorSpecification:
    """Return what the device is, with the noise that a Gamma has in its range."""
    newton, newton_metre = 1.0 / settings.counts_per_newton, 1.0 / settings.counts_per_newton_metre
    return ForceSensorSpecification(
        rated_wrench=settings.rated_wrench,
        noise_std=noise_std(settings.rated_wrench),
        resolution=(newton, newton, newton, newton_metre, newton_metre, newton_metre),
        rate_hz=settings.record_rate_hz,
    )


DRIVER = Driver(ControllerFTSettings, ControllerFT, _specification)
