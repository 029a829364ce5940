"""Emulate a force sensor on a serial line with a constant wrench.

Usage::

    python -m robot_drivers.ati.serial_emulator digital --wrench 1 2 3 0.1 0.2 0.3
    python -m robot_drivers.ati.serial_emulator controller --bit-rate 38400
"""

import argparse
import sys
import threading
from collections.abc import Sequence

import numpy as np

from robot_drivers.ati.controller_ft_emulator import ControllerFTEmulator, ControllerFTEmulatorSettings
from robot_drivers.ati.digital_ft_emulator import DigitalFTEmulator
from robot_drivers.ati.emulator.box import WrenchSource
from robot_drivers.ati.serial_device_emulator import SerialDeviceEmulator


def main(arguments: Sequence[str] | None = None) -> int:
    """Emulate a Digital F/T or an F/T Controller with a constant wrench until interrupted."""
    parser = argparse.ArgumentParser(
        prog="python -m robot_drivers.ati.serial_emulator", description=main.__doc__
    )
    parser.add_argument("device", choices=["digital", "controller"])
    parser.add_argument("--bit-rate", type=int, default=9600, help="of the controller's line, bit/s")
    parser.add_argument(
        "--wrench",
        type=float,
        nargs=6,
        default=(1.0, -2.0, 3.0, 0.01, -0.02, 0.03),
        metavar=("FX", "FY", "FZ", "TX", "TY", "TZ"),
        help="N and N·m",
    )
    options = parser.parse_args(arguments)
    wrench = np.array(options.wrench)
    with _emulator(options.device, options.bit_rate, lambda _time_s: wrench) as device:
        sys.stdout.write(f"emulated {options.device} on {device.port}\n")
        sys.stdout.flush()
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            return 0
    return 0


def _emulator(device: str, bit_rate: int, source: WrenchSource) -> SerialDeviceEmulator:
    if device == "digital":
        return DigitalFTEmulator(source)
    return ControllerFTEmulator(source, ControllerFTEmulatorSettings(bit_rate=bit_rate))


if __name__ == "__main__":
    sys.exit(main())
