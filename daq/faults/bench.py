"""The rig that the faults befall: all emulated devices in one process, which obeys orders and keeps the truth.

The tissue is a spring and the images are made beforehand, so that little is computed while a session runs. The log of
the tool's true places comes from the emulated arm itself; no driver has seen it.
"""

import multiprocessing
import threading
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from daq.errors import SessionError
from daq.lifeline import leave_signals_to_parent
from daq.rig import CameraDevice, Latencies, Rig, write_rig
from daq.virtual_rig.child_processes import end_all, free_udp_port, told
from daq.virtual_rig.layout import FORCE_FILTER_S, REST_TOOL, T_FLANGE_TOOL, Addresses, rig_description
from daq.virtual_rig.load import in_turn
from daq.virtual_rig.rendering.scene import flea2_pair
from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.abb.emulator.settings import EmulatorSettings as ControllerSettings
from robot_drivers.abb.irb140 import IRB140Settings
from robot_drivers.ati.emulator import EmulatorSettings as SensorSettings
from robot_drivers.ati.emulator import NetFTEmulator
from robot_drivers.cameras.emulator import BusClock, CameraEmulator, CameraEmulatorSettings
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.clock import host_time_ns
from robot_drivers.protocols import FloatArray, IntArray, Pose
from robot_drivers.real_time import prefer_this_process, shorten_turns

SILENCE_S = 1.0
"""Longest silence of force sensor and robot before the guard holds the robot."""

WATCHDOG_S = 1.5
"""Longest silence of the client before the controller stops, and of the controller before the client gives it up."""

CAMERA_SILENCE_S = 1.0

FORCE, ROBOT, LEFT, RIGHT, TRUTH = "force sensor", "robot", "left camera", "right camera", "truth"

_RIG_FILE = "rig.toml"
_STEREO_FILE = "stereo.toml"
_FORCE_RATE_HZ = 1000
_FRAMES_PER_S = 6.0
_IMAGES = 4
_PIXELS = (320, 240)
_BUFFERED = 10
_SPRING_N_M = 400.0
_OFFSET = np.array([4.0, -7.0, 12.0, 0.3, -0.2, 0.1])
_ANSWER_TIMEOUT_S = 30.0
_LOG_PERIOD_S = 0.5
_ARM_POLL_S = 0.001
_ARM_LATE_AT_MOST_S = 0.5


@dataclass(frozen=True, slots=True)
class Order:
    """Call a method of one of the emulators; it answers with what that returns."""

    device: str
    method: str
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class TruePath:
    """Where the tool truly was: host time (n,), ns, and place (n, 3), m, robot base frame, oldest first."""

    time_ns: IntArray
    position: FloatArray


class Bench:
    """A running rig: gives orders to its devices and asks for the truth.

    Attributes
    ----------
    rig_path : its rig file
    rig : what stands in it
    """

    def __init__(self, rig_path: Path, rig: Rig, control: Connection) -> None:
        self.rig_path = rig_path
        self.rig = rig
        self._control = control

    def order(self, device: str, method: str, *arguments: object) -> Any:
        """Have a method of an emulator called, and return what it does.

        Raises
        ------
        SessionError
            The rig does not answer.
        """
        try:
            self._control.send(Order(device, method, arguments))
            if not self._control.poll(_ANSWER_TIMEOUT_S):
                raise SessionError("the rig of the campaign does not answer; the computer is too busy")
            return self._control.recv()
        except (EOFError, BrokenPipeError) as error:
            raise SessionError("the rig of the campaign has died; see the messages above") from error

    def write_rig_file(self) -> None:
        """Write the rig file anew, whatever has become of it."""
        write_rig(self.rig, self.rig_path)

    def path(self, since_ns: int) -> TruePath:
        """Return where the tool truly was since an instant of the host clock."""
        time_ns, position = self.order(TRUTH, "since", since_ns)
        return TruePath(time_ns, position)


@contextmanager
def bench(folder: Path, seed: int) -> Iterator[Bench]:
    """Run a rig whose files are in ``folder``, an existing one.

    Raises
    ------
    SessionError
        Its process did not start.
    """
    context = multiprocessing.get_context("spawn")
    control, far_end = context.Pipe()
    process = context.Process(target=_run, args=(far_end, seed), name="rig", daemon=True)
    process.start()
    far_end.close()
    try:
        addresses: Addresses = told(control, "the rig of the campaign")
        flea2_pair().save(folder / _STEREO_FILE)
        rig = described(rig_description(addresses, folder / _STEREO_FILE))
        running = Bench(folder / _RIG_FILE, rig, control)
        running.write_rig_file()
        yield running
    finally:
        control.close()
        end_all([process])


def described(rig: Rig) -> Rig:
    """Return the virtual rig with a laboratory's patience instead of that of a demonstration."""
    robot = rig.robot.settings
    assert isinstance(robot, IRB140Settings)
    return replace(
        rig,
        robot=replace(rig.robot, settings=replace(robot, silence_limit_s=WATCHDOG_S)),
        cameras=(_impatient(rig.cameras[0]), _impatient(rig.cameras[1])),
        limits=replace(rig.limits, communication_age_s=SILENCE_S),
        latencies=Latencies(force_s=FORCE_FILTER_S),
    )


def _impatient(camera: CameraDevice) -> CameraDevice:
    settings = camera.settings
    assert isinstance(settings, OpenCVCameraSettings)
    return replace(camera, settings=replace(settings, read_timeout_s=CAMERA_SILENCE_S))


class _Truth:
    """The log of the tool's true places."""

    def __init__(self, controller: ControllerEmulator) -> None:
        self._controller = controller
        self._lock = threading.Lock()
        self._log: list[tuple[int, tuple[float, float, float]]] = []
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._follow, name="truth")
        self._thread.start()

    def since(self, time_ns: int) -> tuple[IntArray, FloatArray]:
        """Return the log from an instant on, and forget what was before."""
        self._look()
        with self._lock:
            self._log = [entry for entry in self._log if entry[0] >= time_ns]
            times = np.array([time for time, _ in self._log], np.int64)
            return times, np.array([place for _, place in self._log], np.float64).reshape(-1, 3)

    def close(self) -> None:
        """Stop following."""
        self._stopping.set()
        self._thread.join()

    def _follow(self) -> None:
        while not self._stopping.wait(_LOG_PERIOD_S):
            self._look()

    def _look(self) -> None:
        with self._lock:
            newest = self._log[-1][0] if self._log else 0
            self._log += [
                (time_ns, pose.position) for time_ns, pose in self._controller.path() if time_ns > newest
            ]


def _run(control: Connection, seed: int) -> None:
    """Run the devices and obey, until the other end closes."""
    leave_signals_to_parent()
    prefer_this_process()
    shorten_turns()
    with ExitStack() as stack:
        arm = ArmSettings(home=REST_TOOL, T_flange_tool=T_FLANGE_TOOL, seed=seed)
        controller = stack.enter_context(
            ControllerEmulator(ControllerSettings(arm=arm, watchdog_s=WATCHDOG_S))
        )
        egm_port = free_udp_port()
        controller.start_egm_stream("127.0.0.1", egm_port)
        settings = SensorSettings(rate_hz=_FORCE_RATE_HZ, burst_s=0.005, seed=seed)
        felt = _spring(controller, lambda time_s: sensor.epoch_ns + round(time_s * 1e9))
        sensor = stack.enter_context(NetFTEmulator(felt, settings))
        left, right = (stack.enter_context(camera) for camera in _cameras(seed))
        truth = _Truth(controller)
        stack.callback(truth.close)
        control.send(
            Addresses(
                rdt_port=sensor.rdt_port,
                http_port=sensor.http_port,
                ft_command_port=sensor.command_port,
                robot_command_port=controller.command_port,
                robot_state_port=controller.state_port,
                egm_port=egm_port,
                camera_urls=(left.url, right.url),
            )
        )
        devices = {FORCE: sensor, ROBOT: controller, LEFT: left, RIGHT: right, TRUTH: truth}
        while True:
            try:
                order = control.recv()
            except EOFError:
                return
            control.send(getattr(devices[order.device], order.method)(*order.arguments))


def _spring(controller: ControllerEmulator, host_ns: Callable[[float], int]) -> Callable[[float], FloatArray]:
    """Return what the force sensor feels at a time of its own clock: the tool's place, by its filter late."""
    rest = np.array(REST_TOOL.position)

    def wrench(time_s: float) -> FloatArray:
        at_ns = host_ns(time_s) - round(FORCE_FILTER_S * 1e9)
        path = _path_until(controller, at_ns)
        after = min(max(1, bisect_left(path, at_ns, key=lambda entry: entry[0])), len(path) - 1)
        (before_ns, before), (after_ns, beyond) = path[after - 1], path[after]
        share = min(1.0, max(0.0, (at_ns - before_ns) / (after_ns - before_ns)))
        place = (1.0 - share) * np.array(before.position) + share * np.array(beyond.position)
        return _OFFSET + np.concatenate([_SPRING_N_M * (place - rest), np.zeros(3)])

    return wrench


def _path_until(controller: ControllerEmulator, time_ns: int) -> Sequence[tuple[int, Pose]]:
    """Return the arm's path up to an instant.

    Where the rigs of a campaign keep the computer busy the emulated arm moves late, if it stamps its cycles right: a
    sensor that did not wait for it would feel, and stamp, what belongs to an earlier instant.
    """
    deadline = time.monotonic() + _ARM_LATE_AT_MOST_S
    path = controller.path()
    while path[-1][0] < time_ns and time.monotonic() < deadline:
        time.sleep(_ARM_POLL_S)
        path = controller.path()
    return path


def _cameras(seed: int) -> list[CameraEmulator]:
    """Return two cameras over a bare table, of a few pixels: nothing is to be measured in their images."""
    (width, height), bus = _PIXELS, BusClock(host_time_ns(), offset_s=17.0, drift=-20e-6)
    brightness = np.linspace(40, 200, width, dtype=np.uint8)
    images = [np.tile(np.roll(brightness, number), (height, 1)) for number in range(_IMAGES)]
    settings = CameraEmulatorSettings(width, height, _FRAMES_PER_S, _BUFFERED)
    shown = in_turn(images, _FRAMES_PER_S)
    return [CameraEmulator(shown, settings, bus, seed=seed + side) for side in (0, 1)]
