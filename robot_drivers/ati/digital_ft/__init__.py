"""An ATI Digital F/T on RS-485: Modbus to set it up, raw gages at 7 kHz to read."""

from robot_drivers.ati.digital_ft.driver import DigitalFT, DigitalFTSettings

__all__ = ["DigitalFT", "DigitalFTSettings"]
