"""A stand-alone ATI F/T Controller (CTL) on RS-232, which resolves the wrench and streams counts."""

from robot_drivers.ati.controller_ft.driver import ControllerFT, ControllerFTSettings

__all__ = ["ControllerFT", "ControllerFTSettings"]
