"""Emulated sensors on RDT, and drivers that reach them."""

from contextlib import closing, contextmanager
from dataclasses import replace

from robot_drivers.ati.axia import Axia, AxiaSettings
from robot_drivers.ati.emulator import AxiaEmulator, NetFTEmulator
from robot_drivers.ati.netft import NetFT, NetFTSettings


@contextmanager
def netft(source, box=None, **settings):
    """An emulated Net F/T box and a driver of it, not yet connected."""
    with NetFTEmulator(source, box) as emulator:
        reach = NetFTSettings(**_reach(emulator), command_port=emulator.command_port)
        with closing(NetFT(replace(reach, **settings))) as sensor:
            yield emulator, sensor


@contextmanager
def axia(source, emulated=None, **settings):
    """An emulated Ethernet Axia and a driver of it, not yet connected."""
    with (
        AxiaEmulator(source, emulated) as emulator,
        closing(Axia(replace(AxiaSettings(**_reach(emulator)), **settings))) as sensor,
    ):
        yield emulator, sensor


def _reach(emulator):
    return {
        "host": "127.0.0.1",
        "rdt_port": emulator.rdt_port,
        "http_port": emulator.http_port,
        "request_pause_s": 0.0,
    }
