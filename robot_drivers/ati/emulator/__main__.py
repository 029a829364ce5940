"""Emulate a Net F/T box with a constant wrench.

Usage::

    python -m robot_drivers.ati.emulator --port 49152 --http-port 8080 --wrench 1 2 3 0.1 0.2 0.3
"""

import argparse
import sys
import threading
from collections.abc import Sequence

import numpy as np

from robot_drivers.ati.emulator import EmulatorSettings, NetFTEmulator


def main(arguments: Sequence[str] | None = None) -> int:
    """Emulate a box with a constant wrench until interrupted."""
    parser = argparse.ArgumentParser(prog="python -m robot_drivers.ati.emulator", description=main.__doc__)
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    parser.add_argument("--port", type=int, default=49152, help="UDP port of RDT (0: any free one)")
    parser.add_argument("--http-port", type=int, default=8080, help="TCP port of the web pages")
    parser.add_argument("--command-port", type=int, default=49151, help="TCP port of the command interface")
    parser.add_argument("--rate", type=int, default=1000, help="RDT rate at power-up, Hz")
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
    settings = EmulatorSettings(
        host=options.host,
        rdt_port=options.port,
        http_port=options.http_port,
        command_port=options.command_port,
        rate_hz=options.rate,
    )
    with NetFTEmulator(lambda _time_s: wrench, settings) as box:
        sys.stdout.write(
            f"Net F/T emulator on {options.host}: RDT {box.rdt_port}, web {box.http_port}, "
            f"commands {box.command_port}; Ctrl-C ends it\n"
        )
        sys.stdout.flush()
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
