"""The two processes of the virtual rig: one with the emulated devices, one that solves the phantom.

Both end when the process that started them does, and leave to it the signals that all hear at once. Where the system
grants it the devices go before the solver and other programs.
"""

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Literal

import numpy as np

from daq.lifeline import leave_signals_to_parent
from daq.one_thread import compute_in_one_thread
from daq.virtual_rig.cameras import AnyCamera, CamerasInUse, cameras_in_use
from daq.virtual_rig.child_processes import free_udp_port
from daq.virtual_rig.layout import (
    FORCE_FILTER_S,
    FRAMES,
    PATIENCE_S,
    REST_TOOL,
    SPECIMEN,
    T_FLANGE_TOOL,
    TOOL,
    Addresses,
)
from daq.virtual_rig.operator import Jog
from daq.virtual_rig.pace import Pace, lateness
from daq.virtual_rig.physics.phantom import PhantomModel, PhantomSolver, PhantomState
from daq.virtual_rig.physics.world import SimulatedTissue, SimulatedTransducer
from estimator.errors import SolverError
from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.abb.emulator.settings import EmulatorSettings as ControllerSettings
from robot_drivers.ati.emulator import EmulatorSettings as SensorSettings
from robot_drivers.ati.emulator import NetFTEmulator
from robot_drivers.cameras.emulator import BusClock
from robot_drivers.clock import living_on
from robot_drivers.laboratory_clock import ClockKeeper
from robot_drivers.protocols import Pose
from robot_drivers.real_time import give_way, prefer_this_process, shorten_turns

_BURST_S = 0.005
_STEPS_BEHIND = 5
# By how much each may be late before the laboratory's clock waits: no more than leaves the recording as it is. In that
# time the gripper goes no further than the last solutions continue as well as another one would.
_TISSUE_BEHIND_S = 0.4
_SIGNALS_BEHIND_S = 0.05
_IMAGE_BEHIND_S = 0.1


@dataclass(frozen=True, slots=True)
class VirtualRigSettings:
    """What the virtual rig is like.

    Attributes
    ----------
    phantom : what is mounted
    seed : of all noise
    force_rate_hz : of the force sensor's stream
    cameras : 2 for the stereo pair, 1 for one that looks straight down
    depth : whether the only camera is a depth camera
    frames_per_s : of all cameras
    sensor_offset : (6,) what an unbiased sensor reads without load, N and N·m
    clock_ppm : how much faster than the host's the force sensor's clock runs
    force_delay_s, camera_delay_s : by how much force or images are late beyond what the rig file knows
    """

    phantom: PhantomModel
    seed: int = 0
    cameras: Literal[1, 2] = 2
    depth: bool = False
    force_rate_hz: int = 1000
    frames_per_s: float = 5.0
    sensor_offset: tuple[float, float, float, float, float, float] = (4.0, -7.0, 12.0, 0.3, -0.2, 0.1)
    clock_ppm: float = 30.0
    force_delay_s: float = 0.0
    camera_delay_s: float = 0.0


@dataclass(frozen=True, slots=True)
class DeviceClocks:
    """The clocks of the emulated devices, which no driver can see."""

    force: BusClock
    robot: BusClock
    cameras: BusClock


def solve_phantom(connection: Connection, phantom: PhantomModel, in_real_time: bool) -> None:
    """Answer every pose with the phantom's state, until the other end closes.

    In real time it comes after the programs that are tried on it, for in nature a phantom costs no time; a laboratory
    that waits for it goes on sooner if it does not.
    """
    leave_signals_to_parent("SIGTERM")
    if in_real_time:
        give_way(_STEPS_BEHIND)
    compute_in_one_thread()
    solver = phantom.build()
    while True:
        try:
            connection.send(_answer(solver, connection.recv()))
        except (EOFError, BrokenPipeError):
            return


def _answer(solver: PhantomSolver, pose: Pose) -> PhantomState | SolverError:
    try:
        return solver.solve(pose)
    except SolverError as error:
        return error


def run_emulators(
    control: Connection,
    notices: Connection,
    solver: Connection,
    settings: VirtualRigSettings,
    clock: Path | None,
) -> None:
    """Run the devices; tell their clocks and addresses over ``control``, obey orders from there, end when it closes.

    What goes wrong is told in lines over ``notices``.

    They live on the clock whose file is ``clock``, which waits for them and for the phantom; without one on the
    computer's, which does not.
    """
    leave_signals_to_parent("SIGTERM")
    prefer_this_process()
    compute_in_one_thread()
    shorten_turns()  # rendering must not keep the fast devices waiting
    with ExitStack() as stack:
        pace = None if clock is None else stack.enter_context(_waiting_clock(clock))
        arm = ArmSettings(home=REST_TOOL, T_flange_tool=T_FLANGE_TOOL, seed=settings.seed)
        controller = stack.enter_context(
            ControllerEmulator(ControllerSettings(arm=arm, watchdog_s=PATIENCE_S))
        )
        egm_port = free_udp_port()
        controller.start_egm_stream("127.0.0.1", egm_port)
        tissue = stack.enter_context(closing(SimulatedTissue(solver, controller.path, FRAMES, notices.send)))
        transducer = SimulatedTransducer(
            tissue, FRAMES, TOOL, SPECIMEN.environment.gravity, np.array(settings.sensor_offset)
        )
        delay_ns = round((FORCE_FILTER_S + settings.force_delay_s) * 1e9)
        sensor_settings = SensorSettings(
            rate_hz=settings.force_rate_hz,
            clock_ppm=settings.clock_ppm,
            burst_s=_BURST_S,
            seed=settings.seed,
        )
        sensor = stack.enter_context(
            NetFTEmulator(
                lambda time_s: transducer.load(force_clock.host_time_ns(time_s) - delay_ns), sensor_settings
            )
        )
        force_clock = BusClock(sensor.epoch_ns, drift=settings.clock_ppm * 1e-6)
        held: list[Pose] = []
        in_use = CamerasInUse(
            pair=settings.cameras > 1,
            depth=settings.depth,
            frames_per_s=settings.frames_per_s,
            delay_s=settings.camera_delay_s,
            seed=settings.seed,
        )
        cameras = cameras_in_use(in_use, tissue.beads, held)
        for camera in cameras.emulators:
            stack.enter_context(camera)
        if pace is not None:
            pace.follow(
                [
                    lateness(tissue.behind_s, _TISSUE_BEHIND_S),
                    tissue.room_s,
                    lateness(lambda: controller.behind_s, _SIGNALS_BEHIND_S),
                    lateness(lambda: sensor.behind_s, _SIGNALS_BEHIND_S),
                    *(lateness(partial(_behind_s, camera), _IMAGE_BEHIND_S) for camera in cameras.emulators),
                ]
            )
        control.send(DeviceClocks(force_clock, BusClock(controller.epoch_ns), cameras.clock))
        control.send(
            Addresses(
                rdt_port=sensor.rdt_port,
                http_port=sensor.http_port,
                ft_command_port=sensor.command_port,
                robot_command_port=controller.command_port,
                robot_state_port=controller.state_port,
                egm_port=egm_port,
                camera_urls=cameras.urls,
                depth_camera=cameras.depth_camera,
            )
        )
        _obey(control, tissue.ended, controller, held)


@contextmanager
def _waiting_clock(path: Path) -> Iterator[Pace]:
    """Make the laboratory's clock, live on it, and say how fast it runs."""
    keeper = ClockKeeper(path)
    with living_on(keeper), Pace(keeper) as pace:
        yield pace


def _behind_s(camera: AnyCamera) -> float:
    return camera.behind_s


def _obey(control: Connection, ended: Connection, controller: ControllerEmulator, held: list[Pose]) -> None:
    """Carry out the operator's orders until the connection closes, or the phantom has come to its end."""
    while ended not in wait([control, ended]):
        try:
            order = control.recv()
        except EOFError:
            return
        if isinstance(order, Jog):
            controller.jog(order.T_base_tool)
        else:
            held[:] = [] if order.T_tissue_board is None else [order.T_tissue_board]
        control.send(order)
