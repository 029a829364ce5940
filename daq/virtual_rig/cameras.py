"""The emulated cameras of the virtual rig: a stereo pair, one that looks straight down, or a depth camera there."""

import ipaddress
import os
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.errors import SessionError
from daq.virtual_rig.layout import CAMERA_READOUT_S, SPECIMEN, STREAM_PATIENCE_S
from daq.virtual_rig.operator import BOARD
from daq.virtual_rig.rendering.board_scene import BoardScene
from daq.virtual_rig.rendering.depth_scene import DepthScene, DepthSettings, depth_above
from daq.virtual_rig.rendering.scene import Scene, SceneSettings, flea2_above, flea2_pair
from robot_drivers.cameras.emulator import BusClock, CameraEmulator, CameraEmulatorSettings, ImageSource
from robot_drivers.clock import host_time_ns
from robot_drivers.genicam.emulator import GigECameraEmulator, GigECameraSettings, GigEDepthSettings
from robot_drivers.genicam.emulator.control import PORT
from robot_drivers.protocols import DepthScale, FloatArray, Pose

_BUFFERED = 5
_COUNT_MM = 0.02
_SCENE = SceneSettings(phantom_size=SPECIMEN.phantom.size_m)
_ADDRESSES = 200

Beads = Callable[[int], FloatArray]
"""Host time, ns, to the beads (m, 3) in the tissue frame then, m."""

AnyCamera = CameraEmulator | GigECameraEmulator


@dataclass(frozen=True, slots=True)
class CamerasInUse:
    """Which cameras there are.

    Attributes
    ----------
    pair : whether a stereo pair, else one
    depth : whether that is a depth camera
    frames_per_s : of all
    delay_s : by how much their images are late beyond what the rig file knows
    seed : of their noise
    """

    pair: bool
    depth: bool
    frames_per_s: float
    delay_s: float
    seed: int


@dataclass(frozen=True, slots=True)
class EmulatedCameras:
    """The emulators, their common clock, and where they are reached: by URLs, or a depth camera by its address."""

    emulators: tuple[AnyCamera, ...]
    clock: BusClock
    urls: tuple[str, ...] = ()
    depth_camera: str = ""


def cameras_in_use(in_use: CamerasInUse, beads: Beads, held: list[Pose]) -> EmulatedCameras:
    """Switch the cameras on; they see the board while ``held`` has its pose, else the phantom.

    Raises
    ------
    SessionError
        This computer has no address for a depth camera.
    """
    return _depth_camera(in_use, beads, held) if in_use.depth else _cameras(in_use, beads, held)


def _cameras(in_use: CamerasInUse, beads: Beads, held: list[Pose]) -> EmulatedCameras:
    bus = BusClock(host_time_ns(), offset_s=17.0, drift=-20e-6)
    stereo = flea2_pair()
    models = (stereo.left, stereo.right) if in_use.pair else (flea2_above(),)
    delay_ns = round(in_use.delay_s * 1e9)
    scenes = [Scene(camera, _SCENE, seed=2 * in_use.seed + side) for side, camera in enumerate(models)]
    boards = [BoardScene(camera, BOARD) for camera in models]

    def image_source(scene: Scene, board: BoardScene) -> ImageSource:
        def expose(time_s: float) -> NDArray[np.uint8]:
            exposure = round(time_s * in_use.frames_per_s)
            for T_tissue_board in held[:]:
                return board.render(T_tissue_board, exposure)
            return scene.render(beads(bus.host_time_ns(time_s) - delay_ns), exposure)

        return expose

    emulated = CameraEmulatorSettings(
        models[0].width,
        models[0].height,
        in_use.frames_per_s,
        _BUFFERED,
        CAMERA_READOUT_S,
        send_timeout_s=STREAM_PATIENCE_S,
    )
    cameras = [
        CameraEmulator(image_source(scene, board), emulated, bus)
        for scene, board in zip(scenes, boards, strict=True)
    ]
    return EmulatedCameras(tuple(cameras), bus, tuple(camera.url for camera in cameras))


def _depth_camera(in_use: CamerasInUse, beads: Beads, held: list[Pose]) -> EmulatedCameras:
    model = depth_above()
    scale = DepthScale(_COUNT_MM * 1e-3, 0.0, 0)
    scene, board = Scene(model, _SCENE, seed=2 * in_use.seed), BoardScene(model, BOARD)
    depth_scene = DepthScene(model, SPECIMEN.phantom.size_m, scale, DepthSettings(), in_use.seed)
    delay_ns = round(in_use.delay_s * 1e9)
    (focal_length_px, _), principal_point_px = model.focal_length, model.principal_point
    settings = GigECameraSettings(
        host=_free_address(),
        width=model.width,
        height=model.height,
        fps=in_use.frames_per_s,
        model="GigE depth",
        readout_s=CAMERA_READOUT_S,
        depth=GigEDepthSettings(
            scale=_COUNT_MM, focal_length_px=focal_length_px, principal_point_px=principal_point_px
        ),
    )

    def expose(time_s: float) -> NDArray[np.uint8]:
        exposure = round(time_s * in_use.frames_per_s)
        for T_tissue_board in held[:]:
            return board.render(T_tissue_board, exposure)
        return scene.render(beads(exposed_ns(time_s)), exposure)

    def measure(time_s: float) -> NDArray[np.uint16]:
        exposure = round(time_s * in_use.frames_per_s)
        for T_tissue_board in held[:]:
            return depth_scene.render_board(T_tissue_board, exposure)
        return depth_scene.render(beads(exposed_ns(time_s)), exposure)

    def exposed_ns(time_s: float) -> int:
        return camera.born_ns + round(time_s * 1e9) - delay_ns

    camera = GigECameraEmulator(expose, settings, in_use.seed, measure)
    return EmulatedCameras((camera,), BusClock(camera.born_ns), depth_camera=settings.host)


def _free_address() -> str:
    """Return an address of the loopback network at which no camera listens; all cameras listen at one port."""
    for host in _loopback_addresses():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
            try:
                tried.bind((host, PORT))
            except OSError:
                continue
            return host
    raise SessionError(
        f"no address of this computer's loopback network has UDP port {PORT} free for an emulated depth camera; end "
        "other emulated cameras, or use the stereo pair"
    )


def _loopback_addresses() -> Iterator[str]:
    first = int(ipaddress.IPv4Address("127.16.0.0"))
    for number in range(_ADDRESSES):
        yield str(ipaddress.IPv4Address(first + (os.getpid() * _ADDRESSES + number) % 2**20))
