"""The virtual laboratory at full load: every device in a process of its own, fast, and without a phantom to solve.

What the recorder is measured against: nothing of the emulated devices' work is done in its process.
"""

import math
import multiprocessing
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.lifeline import leave_signals_to_parent
from daq.rig import Rig, read_rig, write_rig
from daq.virtual_rig.child_processes import end_all, free_udp_port, told
from daq.virtual_rig.layout import (
    REST_TOOL,
    STREAM_PATIENCE_S,
    T_FLANGE_TOOL,
    Addresses,
    placed_beads,
    rig_description,
)
from daq.virtual_rig.rendering.scene import Scene, SceneSettings, flea2_pair
from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.abb.emulator.settings import EmulatorSettings as ControllerSettings
from robot_drivers.ati.emulator import EmulatorSettings as SensorSettings
from robot_drivers.ati.emulator import NetFTEmulator
from robot_drivers.cameras.emulator import BusClock, CameraEmulator, CameraEmulatorSettings
from robot_drivers.clock import host_time_ns
from robot_drivers.protocols import FloatArray

_DIFFERENT_IMAGES = 6
_BUFFERED = 25  # a late emulator must not look like a late recorder


@dataclass(frozen=True, slots=True)
class Load:
    """What the devices deliver.

    Attributes
    ----------
    force_rate_hz : of the force sensor; its wrench swings by 1 N
    frames_per_s : of both cameras, of 1288 × 964 pixels
    colour : whether the cameras deliver the mosaic of the colour sensor
    """

    force_rate_hz: int = 7000
    frames_per_s: float = 25.0
    colour: bool = False


@dataclass(frozen=True, slots=True)
class LoadedRig:
    """Running devices; after :meth:`overload` the force sensor reads 50 N more."""

    rig: Rig
    _overloaded: "Synchronized[int]"

    def overload(self) -> None:
        """Load the force sensor beyond every limit."""
        self._overloaded.value = 1


@contextmanager
def loaded_rig(folder: Path, load: Load) -> Iterator[LoadedRig]:
    """Run the devices, with the rig file in ``folder``, an existing one.

    Raises
    ------
    SessionError
        Their processes did not start.
    """
    context = multiprocessing.get_context("spawn")
    targets = (_run_sensor, _run_robot, _run_left_camera, _run_right_camera)
    pipes = [context.Pipe() for _ in targets]
    overloaded = context.Value("b", 0)
    processes = [
        context.Process(target=target, args=(end, load, overloaded), daemon=True)
        for target, (_, end) in zip(targets, pipes, strict=True)
    ]
    try:
        for process, (_, end) in zip(processes, pipes, strict=True):
            process.start()
            end.close()
        sensor, robot, left, right = (told(control, "an emulated device") for control, _ in pipes)
        flea2_pair().save(folder / "stereo.toml")
        addresses = Addresses(**sensor, **robot, camera_urls=(left["url"], right["url"]))
        write_rig(rig_description(addresses, folder / "stereo.toml"), folder / "rig.toml")
        yield LoadedRig(read_rig(folder / "rig.toml"), overloaded)
    finally:
        for control, _ in pipes:
            control.close()
        end_all(processes)


def _run_sensor(control: Connection, load: Load, overloaded: "Synchronized[int]") -> None:
    # what is read seven thousand times a second is read without the lock
    switch = overloaded.get_obj()

    def wrench(time_s: float) -> FloatArray:
        return np.array([math.sin(time_s) + 50.0 * switch.value, 2.0, 3.0, 0.1, 0.2, 0.3])

    with NetFTEmulator(wrench, SensorSettings(rate_hz=load.force_rate_hz, burst_s=0.005)) as sensor:
        ports = {"rdt_port": sensor.rdt_port, "http_port": sensor.http_port}
        _serve(control, {**ports, "ft_command_port": sensor.command_port})


def _run_robot(control: Connection, load: Load, overloaded: "Synchronized[int]") -> None:
    settings = ControllerSettings(
        arm=ArmSettings(home=REST_TOOL, T_flange_tool=T_FLANGE_TOOL), watchdog_s=2.0
    )
    with ControllerEmulator(settings) as robot:
        egm_port = free_udp_port()
        robot.start_egm_stream("127.0.0.1", egm_port)
        ports = {"robot_command_port": robot.command_port, "robot_state_port": robot.state_port}
        _serve(control, {**ports, "egm_port": egm_port})


def _run_left_camera(control: Connection, load: Load, overloaded: "Synchronized[int]") -> None:
    _run_camera(control, load, side=0)


def _run_right_camera(control: Connection, load: Load, overloaded: "Synchronized[int]") -> None:
    _run_camera(control, load, side=1)


def _run_camera(control: Connection, load: Load, side: int) -> None:
    camera = (flea2_pair().left, flea2_pair().right)[side]
    scene = Scene(camera, SceneSettings(pixel_format="bayer_rggb8" if load.colour else "mono8"), seed=side)
    images = [scene.render(placed_beads(0), number) for number in range(_DIFFERENT_IMAGES)]
    settings = CameraEmulatorSettings(
        camera.width, camera.height, load.frames_per_s, _BUFFERED, send_timeout_s=STREAM_PATIENCE_S
    )
    with CameraEmulator(in_turn(images, load.frames_per_s), settings, BusClock(host_time_ns())) as emulator:
        _serve(control, {"url": emulator.url})


def in_turn(images: list[NDArray[np.uint8]], frames_per_s: float) -> Callable[[float], NDArray[np.uint8]]:
    """Return what an emulated camera sees that shows these images one after another."""
    return lambda time_s: images[round(time_s * frames_per_s) % len(images)]


def _serve(control: Connection, told: dict[str, Any]) -> None:
    """Tell where the device listens, and wait until the other end closes."""
    leave_signals_to_parent()
    control.send(told)
    try:
        control.recv()
    except EOFError:
        return
