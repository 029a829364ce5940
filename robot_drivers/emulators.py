"""Every emulator as something that can be started by name, with its settings and faults as options.

A new emulator is one more entry of :data:`KINDS`.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from robot_drivers.abb.emulator import ControllerEmulator
from robot_drivers.abb.emulator_guidance import GuidanceMode, GuidanceSettings, GuidanceState
from robot_drivers.abb.emulator_settings import ArmSettings, ControllerFaults
from robot_drivers.abb.emulator_settings import EmulatorSettings as ControllerSettings
from robot_drivers.abb.open_abb_emulator import OpenABBEmulator, OpenABBEmulatorSettings
from robot_drivers.ati.controller_ft_emulator import ControllerFTEmulator, ControllerFTEmulatorSettings
from robot_drivers.ati.digital_ft_emulator import DigitalFTEmulator, DigitalFTEmulatorSettings
from robot_drivers.ati.emulator import EmulatorSettings as BoxSettings
from robot_drivers.ati.emulator import Faults as BoxFaults
from robot_drivers.ati.emulator import NetFTEmulator, WrenchSource
from robot_drivers.ati.emulator.netbox_can import CanFaults, NetBoxCanEmulator, NetBoxCanEmulatorSettings
from robot_drivers.ati.emulator.netcanoem import BoardFaults, BoardSettings, NetCANOEMEmulator
from robot_drivers.ati.gages import FT33206, HIGHEST_GAGE
from robot_drivers.ati.serial_line_emulator import LineFaults
from robot_drivers.ati.slcan_adapter_emulator import SlcanAdapterEmulator
from robot_drivers.cameras.emulator import CameraEmulator, CameraEmulatorSettings, CameraFaults
from robot_drivers.errors import ConfigurationError

_DEFAULT_CHANNEL = "emulated"

Wrench = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class Running:
    """An emulator that listens: where, in one line, and what it has to report at the moment (empty for nothing)."""

    where: str
    report: Callable[[], str] = field(default=lambda: "")


@dataclass(frozen=True, slots=True)
class EmulatorKind:
    """One kind of emulator.

    Attributes
    ----------
    summary : what it emulates
    options : title and dataclass of its options; none of their fields may have the name of another's
    start : makes it from instances of these dataclasses, in their order
    flags : options named otherwise than their fields
    example : options that show something
    """

    summary: str
    options: Mapping[str, type[Any]]
    start: Callable[..., AbstractContextManager[Running]]
    flags: Mapping[str, str] = field(default_factory=dict)
    example: str = ""


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


@dataclass(frozen=True, slots=True)
class BoxOnCanFaults:
    """What befalls a Net F/T box on a CAN bus. Times count from the start.

    Attributes
    ----------
    unplug_at_s, unplug_for_s : the cable of the bus is out meanwhile; the box goes on
    restart_at_s, restart_for_s : the box loses power meanwhile, and with it bias, latch and sample number
    saturated : all gages at the end of their range
    drift_per_s : wrench error that grows with time, N/s and N·m/s
    status : bits raised in the status word
    """

    unplug_at_s: float = math.inf
    unplug_for_s: float = 0.0
    restart_at_s: float = math.inf
    restart_for_s: float = 0.0
    saturated: bool = False
    drift_per_s: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    status: int = 0


@dataclass(frozen=True, slots=True)
class OpenABBFaults:
    """Departures from a healthy open-abb server.

    Attributes
    ----------
    mute : the program hangs: it answers nothing
    landing_offset : how far beside its target a motion ends, m
    """

    mute: bool = False
    landing_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class EgmSession:
    """What the controller does over EGM.

    Attributes
    ----------
    egm : HOST:PORT of the PC that the controller sends to; empty for no EGM
    generation : layout of the messages, by RobotWare: A 6.00-6.06, B 6.07-6.09, B' from 6.10, C about 6.14, D 7.16
    guidance : whether the PC guides the arm, and by what; "off" is the position stream
    """

    egm: str = ""
    generation: Literal["A", "B", "B'", "C", "D"] = "B'"
    guidance: Literal["off", "pose", "joint"] = "off"


@dataclass(frozen=True, slots=True)
class Scene:
    """What a camera without a specimen sees.

    Attributes
    ----------
    image_seed : of the places of sixteen dark beads
    sway_px : how far they sway, once in four seconds
    """

    image_seed: int = 0
    sway_px: float = 10.0


@contextmanager
def _netft(settings: BoxSettings, load: Load, faults: BoxFaults) -> Iterator[Running]:
    with NetFTEmulator(load.at, settings) as box:
        box.inject(faults)
        yield Running(
            f"Net F/T box on {settings.host}: RDT UDP {box.rdt_port}, web TCP {box.http_port}, "
            f"commands TCP {box.command_port}"
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
        box.inject(BoxFaults(**asdict(of_box)))
        with _reachable_bus(settings.interface, settings.channel) as bus:
            yield Running(f"Net F/T box on CAN with base {settings.base:#05x} on {bus}")


@contextmanager
def _reachable_bus(interface: str, channel: str) -> Iterator[str]:
    """Join a virtual bus, which ends at this process, with an emulated serial adapter; give interface and channel."""
    if interface != "virtual":
        yield f"{interface} {channel}"
        return
    with SlcanAdapterEmulator(channel) as adapter:
        yield f"slcan {adapter.port}"


@contextmanager
def _irb140(
    settings: ControllerSettings,
    arm: ArmSettings,
    session: EgmSession,
    guidance: GuidanceSettings,
    faults: ControllerFaults,
) -> Iterator[Running]:
    with ControllerEmulator(replace(settings, arm=arm)) as controller:
        controller.inject(faults)
        where = (
            f"IRB 140 controller on {settings.bind_address}: commands TCP {controller.command_port}, "
            f"state TCP {controller.state_port}"
        )
        if session.egm:
            host, port = _host_and_port(session.egm)
            where += f", EGM to UDP {host}:{port}"
            if session.guidance == "off":
                controller.start_egm_stream(host, port, session.generation)
            else:
                mode = GuidanceMode.POSE if session.guidance == "pose" else GuidanceMode.JOINT
                controller.start_guidance(host, port, replace(guidance, mode=mode), session.generation)
        yield Running(where, lambda: _guidance_report(controller))


@contextmanager
def _open_abb(
    settings: OpenABBEmulatorSettings, arm: ArmSettings, faults: OpenABBFaults
) -> Iterator[Running]:
    with OpenABBEmulator(replace(settings, arm=arm)) as controller:
        controller.mute = faults.mute
        controller.landing_offset = faults.landing_offset
        yield Running(f"open-abb server of an IRB 140 on {settings.bind_address}: TCP {controller.port}")


def _guidance_report(controller: ControllerEmulator) -> str:
    guidance = controller.guidance
    if guidance is None or guidance.state is GuidanceState.RUNNING:
        return ""
    if guidance.state is GuidanceState.CONVERGED:
        return "EGM guidance has ended: converged for CondTime"
    return (
        f"EGM guidance has failed: event {guidance.event}"
        if guidance.event
        else "EGM guidance has failed: limits"
    )


def _host_and_port(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal():
        raise ConfigurationError(f"--egm {text!r}: must be HOST:PORT, such as 127.0.0.1:6510")
    return host, int(port)


@contextmanager
def _camera(settings: CameraEmulatorSettings, scene: Scene, faults: CameraFaults) -> Iterator[Running]:
    with CameraEmulator(_beads(settings, scene), settings, seed=scene.image_seed) as camera:
        camera.inject(faults)
        yield Running(
            f"camera on {camera.url}: {settings.width}x{settings.height}, {settings.fps:g}/s, mono8"
        )


def _beads(settings: CameraEmulatorSettings, scene: Scene) -> Callable[[float], NDArray[np.uint8]]:
    random = np.random.default_rng(scene.image_seed)
    height, width = settings.height, settings.width
    background = np.full((height, width), 200, np.uint8)
    radius = max(2, min(height, width) // 60)
    margin = radius + 1
    places = random.uniform((margin, margin), (height - margin, width - margin), (16, 2))
    rows, columns = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    disc = rows**2 + columns**2 <= radius**2

    def image(time_s: float) -> NDArray[np.uint8]:
        picture = background.copy()
        shift = scene.sway_px * math.sin(math.tau * time_s / 4.0)
        for row, column in places:
            x = int(np.clip(column + shift, margin, width - margin - 1))
            y = int(row)
            picture[y - radius : y + radius + 1, x - radius : x + radius + 1][disc] = 40
        return picture

    return image


KINDS: Mapping[str, EmulatorKind] = {
    "netft": EmulatorKind(
        "ATI Net F/T box: RDT over UDP, web pages, command interface",
        {"box": BoxSettings, "load": Load, "faults": BoxFaults},
        _netft,
        {"rdt_port": "--port"},
        "--port 49152 --http-port 8080 --loss 0.01 --drift-per-s 0.1 0 0 0 0 0",
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
    "netbox_can": EmulatorKind(
        "ATI Net F/T box on its native CAN protocol, by default behind an emulated serial adapter (slcan)",
        {"box": NetBoxCanEmulatorSettings, "load": Load, "faults": BoxOnCanFaults, "bus": CanFaults},
        _netbox_can,
        example="--base 0x1B0 --halving 0.01 --unplug-at-s 10 --unplug-for-s 2",
    ),
    "irb140": EmulatorKind(
        "ABB IRC5 controller with an IRB 140: RAPID server, EGM",
        {
            "controller": ControllerSettings,
            "arm": ArmSettings,
            "EGM": EgmSession,
            "EGM guidance": GuidanceSettings,
            "faults": ControllerFaults,
        },
        _irb140,
        {"command_port": "--port"},
        "--port 5000 --state-port 5001 --egm 127.0.0.1:6510 --guidance pose --comm-timeout-s 0.2",
    ),
    "open_abb": EmulatorKind(
        "ABB controller with an IRB 140 and an open-abb server",
        {"controller": OpenABBEmulatorSettings, "arm": ArmSettings, "faults": OpenABBFaults},
        _open_abb,
        example="--port 5000 --landing-offset 0 0 0.001",
    ),
    "camera": EmulatorKind(
        "a free-running camera with embedded frame information, on a TCP port",
        {"camera": CameraEmulatorSettings, "scene": Scene, "faults": CameraFaults},
        _camera,
        example="--fps 15 --loss 0.05 --restart-at-s 10 --restart-for-s 2",
    ),
}
