"""A stand-alone ATI F/T Controller (CTL) on RS-232, which resolves the wrench and streams counts."""

from dataclasses import replace

from robot_drivers.ati.controller_ft.driver import ControllerFT, ControllerFTSettings
from robot_drivers.ati.transducer.gamma import specification
from robot_drivers.driver import Driver
from robot_drivers.specification import ForceSensorSpecification

__all__ = ["DRIVER", "ControllerFT", "ControllerFTSettings"]


def _specification(settings: ControllerFTSettings) -> ForceSensorSpecification:
    """Return what the device is, and the size of its counts."""
    newton, newton_metre = 1.0 / settings.counts_per_newton, 1.0 / settings.counts_per_newton_metre
    return replace(
        specification(settings.rated_wrench, settings.record_rate_hz),
        resolution=(newton, newton, newton, newton_metre, newton_metre, newton_metre),
    )


DRIVER = Driver(ControllerFTSettings, ControllerFT, _specification)
