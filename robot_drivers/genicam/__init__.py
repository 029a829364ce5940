"""GenICam cameras (GigE Vision, USB3 Vision) through Aravis."""

from robot_drivers.driver import Driver
from robot_drivers.genicam.camera import GenICamCamera
from robot_drivers.genicam.settings import GenICamSettings
from robot_drivers.interfaces import is_address
from robot_drivers.specification import CameraSpecification

__all__ = ["DRIVER", "GenICamCamera", "GenICamSettings"]


def _specification(settings: GenICamSettings) -> CameraSpecification:
    return CameraSpecification(
        host=settings.camera if is_address(settings.camera) else "",
        frames_per_s=settings.fps,
        depth=settings.depth,
    )


DRIVER = Driver(GenICamSettings, GenICamCamera, _specification)
