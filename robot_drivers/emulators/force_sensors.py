"""Emulated force/torque sensors, by name."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.emulator import (
    AxiaEmulator,
    AxiaEmulatorSettings,
    EmulatorSettings,
    Faults,
    NetFTEmulator,
    WrenchSource,
)
from robot_drivers.ati.emulator.can.netbox_can import CanFaults, NetBoxCanEmulator, NetBoxCanEmulatorSettings
from robot_drivers.ati.emulator.can.netcanoem import BoardFaults, BoardSettings, NetCANOEMEmulator
from robot_drivers.ati.emulator.can.slcan_adapter import SlcanAdapterEmulator
from robot_drivers.ati.emulator.sensor import RdtSensorEmulator
from robot_drivers.ati.emulator.serial.controller_ft import ControllerFTEmulator, ControllerFTEmulatorSettings
from robot_drivers.ati.emulator.serial.digital_ft import DigitalFTEmulator, DigitalFTEmulatorSettings
from robot_drivers.ati.transducer.gages import FT33206, HIGHEST_GAGE
from robot_drivers.bota.emulator import BotaEmulator, BotaEmulatorSettings
from robot_drivers.emulated_outages import Outages
from robot_drivers.emulators.kind import EmulatorKind, Running
from robot_drivers.serial_line.emulator.line import LineFaults

_DEFAULT_CHANNEL = "emulated"

Wrench = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class Load:
    """What a force sensor without a specimen feels.

    Attributes
    ----------
    wrench : constant part, N and N·m
    amplitude : of a sine on top of it, N and N·m
    frequency_hz : of the sine
    """

    wrench: Wrench = (1.0, -2.0, 3.0, 0.01, -0.02, 0.03)
    amplitude: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    frequency_hz: float = 0.5

    def at(self, time_s: float) -> NDArray[np.float64]:
        """Return the wrench (6,) at a device time."""
        return np.array(self.wrench) + np.sin(math.tau * self.frequency_hz * time_s) * np.array(
            self.amplitude
        )


@dataclass(frozen=True, slots=True)
class TransducerFaults:
    """Departures from a healthy transducer, for devices whose own faults are those of the line.

    Attributes
    ----------
    drift_per_s : wrench error that grows with time, N/s and N·m/s
    saturated : all gages at the end of their range
    """

    drift_per_s: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    saturated: bool = False

    def source(self, load: Load) -> WrenchSource:
        """Return what the gages make of a load."""
        drift = np.array(self.drift_per_s)
        overload = FT33206.wrench(np.full(6, 2.0 * HIGHEST_GAGE))
        return lambda time_s: overload if self.saturated else load.at(time_s) + drift * time_s


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxOnCanFaults(Outages):
    """What befalls a Net F/T box on a CAN bus. Times count from the start.

    Attributes
    ----------
    unplug_at_s, unplug_for_s : the cable of the bus is out meanwhile; the box goes on
    restart_at_s, restart_for_s : the box loses power meanwhile, and with it bias, latch and sample number
    saturated : all gages at the end of their range
    drift_per_s : wrench error that grows with time, N/s and N·m/s
    status : bits raised in the status word
    """

    saturated: bool = False
    drift_per_s: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    status: int = 0


@contextmanager
def _netft(settings: EmulatorSettings, load: Load, faults: Faults) -> Iterator[Running]:
    with NetFTEmulator(load.at, settings) as box:
        yield _running("Net F/T box", settings.host, box, faults)


@contextmanager
def _axia(settings: AxiaEmulatorSettings, load: Load, faults: Faults) -> Iterator[Running]:
    with AxiaEmulator(load.at, settings) as sensor:
        yield _running("Ethernet Axia", settings.host, sensor, faults)


def _running(product: str, host: str, sensor: RdtSensorEmulator, faults: Faults) -> Running:
    sensor.inject(faults)
    return Running(
        f"{product} on {host}: RDT UDP {sensor.rdt_port}, web TCP {sensor.http_port}, "
        f"commands TCP {sensor.command_port}"
    )


@contextmanager
def _digital_ft(
    settings: DigitalFTEmulatorSettings, load: Load, transducer: TransducerFaults, faults: LineFaults
) -> Iterator[Running]:
    with DigitalFTEmulator(transducer.source(load), settings) as device:
        device.inject(faults)
        yield Running(f"Digital F/T on {device.port}: Modbus address {settings.slave_address}")


@contextmanager
def _controller_ft(
    settings: ControllerFTEmulatorSettings, load: Load, transducer: TransducerFaults, faults: LineFaults
) -> Iterator[Running]:
    with ControllerFTEmulator(transducer.source(load), settings) as device:
        device.inject(faults)
        yield Running(
            f"F/T Controller on {device.port}: {settings.bit_rate} bit/s, {settings.record_bits} bit counts"
        )


@contextmanager
def _netcanoem(
    settings: BoardSettings, load: Load, transducer: TransducerFaults, faults: BoardFaults
) -> Iterator[Running]:
    with NetCANOEMEmulator(transducer.source(load), settings) as board:
        board.faults = faults
        with _reachable_bus(settings.interface, settings.channel) as bus:
            yield Running(f"NETCANOEM board with base {settings.base:#04x} on {bus}")


@contextmanager
def _netbox_can(
    settings: NetBoxCanEmulatorSettings, load: Load, of_box: BoxOnCanFaults, faults: CanFaults
) -> Iterator[Running]:
    settings = replace(settings, channel=settings.channel or _DEFAULT_CHANNEL)
    with NetBoxCanEmulator(load.at, settings) as box:
        box.faults = faults
        box.inject(Faults(**asdict(of_box)))
        with _reachable_bus(settings.interface, settings.channel) as bus:
            yield Running(f"Net F/T box on CAN with base {settings.base:#05x} on {bus}")


@contextmanager
def _bota(
    settings: BotaEmulatorSettings, load: Load, transducer: TransducerFaults, faults: LineFaults
) -> Iterator[Running]:
    with BotaEmulator(transducer.source(load), settings) as sensor:
        sensor.inject(faults)
        yield Running(f"Bota sensor on {sensor.port}: {51200 / settings.sinc_length:g} frames a second")


@contextmanager
def _reachable_bus(interface: str, channel: str) -> Iterator[str]:
    """Join a virtual bus, which ends at this process, with an emulated serial adapter; give interface and channel."""
    if interface != "virtual":
        yield f"{interface} {channel}"
        return
    with SlcanAdapterEmulator(channel) as adapter:
        yield f"slcan {adapter.port}"


FORCE_SENSORS: Mapping[str, EmulatorKind] = {
    "netft": EmulatorKind(
        "ATI Net F/T box: RDT over UDP, web pages, command interface",
        {"box": EmulatorSettings, "load": Load, "faults": Faults},
        _netft,
        {"rdt_port": "--port"},
        "--port 49152 --http-port 8080 --loss 0.01 --drift-per-s 0.1 0 0 0 0 0",
    ),
    "axia": EmulatorKind(
        "ATI Ethernet Axia: RDT over UDP, web pages, command interface",
        {"sensor": AxiaEmulatorSettings, "load": Load, "faults": Faults},
        _axia,
        {"rdt_port": "--port"},
        "--port 49152 --http-port 8080 --sample-rate-hz 976 --rate-hz 500 --loss 0.01",
    ),
    "digital_ft": EmulatorKind(
        "ATI Digital F/T on a pseudo-terminal: Modbus and its stream",
        {"device": DigitalFTEmulatorSettings, "load": Load, "gages": TransducerFaults, "faults": LineFaults},
        _digital_ft,
        example="--sample-rate-hz 1000 --loss 0.0001",
    ),
    "controller_ft": EmulatorKind(
        "ATI stand-alone F/T Controller on a pseudo-terminal: RS-232",
        {
            "device": ControllerFTEmulatorSettings,
            "load": Load,
            "gages": TransducerFaults,
            "faults": LineFaults,
        },
        _controller_ft,
        example="--bit-rate 38400 --unplug-at-s 10 --unplug-for-s 2",
    ),
    "netcanoem": EmulatorKind(
        "ATI NETCANOEM board on a CAN bus, by default behind an emulated serial adapter (slcan)",
        {"board": BoardSettings, "load": Load, "gages": TransducerFaults, "faults": BoardFaults},
        _netcanoem,
        example="--bus-off-at-s 5 --bus-off-for-s 2",
    ),
    "bota": EmulatorKind(
        "Bota Systems sensor on a pseudo-terminal: binary frames with their CRC",
        {"sensor": BotaEmulatorSettings, "load": Load, "gages": TransducerFaults, "faults": LineFaults},
        _bota,
        example="--sinc-length 512 --corruption 0.0001 --restart-at-s 10 --restart-for-s 2",
    ),
    "netbox_can": EmulatorKind(
        "ATI Net F/T box on its native CAN protocol, by default behind an emulated serial adapter (slcan)",
        {"box": NetBoxCanEmulatorSettings, "load": Load, "faults": BoxOnCanFaults, "bus": CanFaults},
        _netbox_can,
        example="--base 0x1B0 --halving 0.01 --unplug-at-s 10 --unplug-for-s 2",
    ),
}
