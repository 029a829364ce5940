"""Emulated cameras, by name."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robot_drivers.cameras.emulator import CameraEmulator, CameraEmulatorSettings, CameraFaults
from robot_drivers.emulators.kind import EmulatorKind, Running
from robot_drivers.genicam.emulator import (
    GigECameraEmulator,
    GigECameraSettings,
    GigEDepthSettings,
    GigEFaults,
)

_RANGE_COUNTS, _NOISE_COUNTS = 20_000, 5.0


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
def _camera(settings: CameraEmulatorSettings, scene: Scene, faults: CameraFaults) -> Iterator[Running]:
    with CameraEmulator(_beads(settings, scene), settings, seed=scene.image_seed) as camera:
        camera.inject(faults)
        yield Running(
            f"camera on {camera.url}: {settings.width}x{settings.height}, {settings.fps:g}/s, mono8"
        )


@contextmanager
def _gige(settings: GigECameraSettings, scene: Scene, faults: GigEFaults) -> Iterator[Running]:
    with GigECameraEmulator(_beads(settings, scene), settings, seed=scene.image_seed) as camera:
        camera.inject(faults)
        yield Running(
            f"GigE Vision camera on {settings.host}: {settings.width}x{settings.height}, {settings.fps:g}/s, "
            f"{settings.pixel_format}"
        )


@contextmanager
def _gige_depth(
    settings: GigECameraSettings, depth: GigEDepthSettings, scene: Scene, faults: GigEFaults
) -> Iterator[Running]:
    with_depth, image = replace(settings, depth=depth), _beads(settings, scene)
    random = np.random.default_rng(scene.image_seed)

    def plane(time_s: float) -> NDArray[np.uint16] | NDArray[np.float32]:
        counts = random.normal(_RANGE_COUNTS, _NOISE_COUNTS, (settings.height, settings.width))
        if depth.depth_format == "Coord3D_C32f":
            return counts.astype(np.float32)
        return np.rint(counts).astype(np.uint16)

    with GigECameraEmulator(image, with_depth, scene.image_seed, plane) as camera:
        camera.inject(faults)
        yield Running(
            f"GigE Vision camera with depth on {settings.host}: {settings.width}x{settings.height}, "
            f"{settings.fps:g}/s, {settings.pixel_format} and {depth.depth_format}"
        )


def _beads(
    settings: CameraEmulatorSettings | GigECameraSettings, scene: Scene
) -> Callable[[float], NDArray[np.uint8]]:
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


CAMERAS: Mapping[str, EmulatorKind] = {
    "camera": EmulatorKind(
        "a free-running camera with embedded frame information, on a TCP port",
        {"camera": CameraEmulatorSettings, "scene": Scene, "faults": CameraFaults},
        _camera,
        example="--fps 15 --loss 0.05 --restart-at-s 10 --restart-for-s 2",
    ),
    "gige": EmulatorKind(
        "a GigE Vision camera with a GenICam description, chunk time stamps and PTP, on UDP port 3956",
        {"camera": GigECameraSettings, "scene": Scene, "faults": GigEFaults},
        _gige,
        example="--host 127.0.0.2 --fps 15 --packet-loss 0.05",
    ),
    "gige_depth": EmulatorKind(
        "a GigE Vision camera that sends with each image one of depth, of a plane, on UDP port 3956",
        {"camera": GigECameraSettings, "depth": GigEDepthSettings, "scene": Scene, "faults": GigEFaults},
        _gige_depth,
        example="--host 127.0.0.3 --fps 5 --mode RectifiedC",
    ),
}
