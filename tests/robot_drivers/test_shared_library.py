"""Camera drivers on a library of the system: one that is missing, or is another, is told with what to install."""

from collections.abc import Callable

import pytest

from robot_drivers.cameras.dc1394 import DC1394Camera, DC1394CameraSettings
from robot_drivers.errors import ConfigurationError
from robot_drivers.genicam import GenICamCamera, GenICamSettings
from robot_drivers.protocols import Camera


def firewire(library: str) -> Camera:
    return DC1394Camera(DC1394CameraSettings(library=library))


def genicam(library: str) -> Camera:
    return GenICamCamera(GenICamSettings(camera="127.0.0.1", library=library))


@pytest.mark.parametrize(("camera", "package"), [(firewire, "libdc1394-25"), (genicam, r"libaravis-0\.8-0")])
def test_a_missing_library_is_told_with_the_package_to_install(
    camera: Callable[[str], Camera], package: str
) -> None:
    with pytest.raises(
        ConfigurationError, match=f"libnone.so.* install it .*sudo apt install {package}.*set library"
    ):
        camera("libnone.so").connect()


@pytest.mark.parametrize(("camera", "function"), [(firewire, "dc1394_new"), (genicam, "arv_camera_is_gv")])
def test_a_library_that_lacks_a_function_is_told_with_its_name(
    camera: Callable[[str], Camera], function: str
) -> None:
    with pytest.raises(ConfigurationError, match=function):
        camera("libc.so.6").connect()
