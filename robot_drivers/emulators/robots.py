"""Emulated controllers of robots, by name."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.guidance import GuidanceMode, GuidanceSettings, GuidanceState
from robot_drivers.abb.emulator.open_abb import OpenABBEmulator, OpenABBEmulatorSettings
from robot_drivers.abb.emulator.settings import ArmSettings, ControllerFaults, EmulatorSettings
from robot_drivers.emulators.force_sensors import Load
from robot_drivers.emulators.kind import EmulatorKind, Running
from robot_drivers.errors import ConfigurationError
from robot_drivers.universal_robots.emulator import URControllerEmulator, UREmulatorSettings, URFaults


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


@contextmanager
def _irb140(
    settings: EmulatorSettings,
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
def _ur(settings: UREmulatorSettings, load: Load, faults: URFaults) -> Iterator[Running]:
    with URControllerEmulator(settings, wrench=load.at) as controller:
        controller.inject(faults)
        yield Running(
            f"controller of a {settings.arm} on {settings.bind_address}: RTDE TCP {controller.port}"
        )


ROBOTS: Mapping[str, EmulatorKind] = {
    "irb140": EmulatorKind(
        "ABB IRC5 controller with an IRB 140: RAPID server, EGM",
        {
            "controller": EmulatorSettings,
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
    "ur": EmulatorKind(
        "Universal Robots controller with an e-Series arm: RTDE, servo program, sensor in the flange",
        {"controller": UREmulatorSettings, "load on the flange": Load, "faults": URFaults},
        _ur,
        example="--port 30004 --arm UR5e --wrench 0 0 -5 0 0 0",
    ),
}
