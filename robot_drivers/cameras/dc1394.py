"""FireWire (IIDC) cameras through libdc1394, an optional library: ``apt install libdc1394-25``.

No OpenCV wheel opens such a camera. Through this driver the image arrives untouched, with the counter and the bus's
cycle time that the camera embeds in its first pixels, and with the kernel's receive stamp.
"""

import select
import time
from collections.abc import Sequence

from robot_drivers.cameras.dc1394_camera import BusTime, Camera1394, Image
from robot_drivers.cameras.dc1394_library import DC1394Library
from robot_drivers.cameras.dc1394_settings import DC1394CameraSettings
from robot_drivers.cameras.frame_buffer import FrameBuffer
from robot_drivers.cameras.streamed_camera import StreamedCamera
from robot_drivers.driver import Driver
from robot_drivers.errors import DeviceError, DeviceProtocolError, DeviceTimeoutError
from robot_drivers.protocols import DeviceIdentity, Frame
from robot_drivers.specification import CameraSpecification

__all__ = ["DRIVER", "BusTime", "DC1394Camera", "DC1394CameraSettings"]

_POLL_S = 0.1
_CYCLE_TIME_WRAP_S = 128.0
_OLDEST_FIRST_IMAGE_S = 5.0
_BUS_CLOCK_ERROR_S = 0.01


class DC1394Camera(StreamedCamera[Camera1394]):
    """A camera on a FireWire bus; ``malformed`` in its statistics are images that arrived damaged."""

    def __init__(self, settings: DC1394CameraSettings) -> None:
        super().__init__(
            f"camera {settings.guid or 'on FireWire'}",
            lambda: FrameBuffer(settings.buffer_frames, settings.pixel_format, settings.embedded_info),
        )
        self._settings = settings

    def bus_time(self) -> BusTime:
        """Read the bus's cycle timer and the host clock together.

        Device times of images are the cycle time, unwrapped, so this maps them to the host clock from both sides.
        """
        return self._connected().bus_time()

    def _open(self) -> Camera1394:
        return Camera1394(DC1394Library(self._settings.library), self._settings)

    def _begin(self, source: Camera1394) -> DeviceIdentity:
        first = self._wait_for_image(source)
        if first.device_time_s is not None:
            _check_bus_time(first.device_time_s, source)
        return _identity(source, self._settings)

    def _release(self, source: Camera1394) -> None:
        source.close()

    def _wait_for_image(self, camera: Camera1394) -> Frame:
        deadline = time.monotonic() + self._settings.silence_s
        while time.monotonic() < deadline:
            frames = [self._keep(image) for image in _waiting(camera) if image is not None]
            if frames:
                return frames[-1]
        raise _silent(camera, self._settings.silence_s)

    def _run(self, source: Camera1394) -> None:
        last_sign = time.monotonic()
        while not self._stopping.is_set():
            try:
                images = _waiting(source)
            except DeviceError as error:
                self._buffer.fail(error)
                return
            for image in images:
                self._keep_or_reject(image)
                last_sign = time.monotonic()
            if time.monotonic() - last_sign > self._settings.silence_s:
                self._buffer.fail(_silent(source, self._settings.silence_s))
                return

    def _keep(self, image: Image) -> Frame:
        return self._buffer.add_raw(image.pixels, image.host_time_ns)

    def _keep_or_reject(self, image: Image | None) -> None:
        try:
            if image is not None:
                self._keep(image)
                return
        except DeviceProtocolError:
            pass  # its first pixels hold no information: as damaged as one that the library finds so
        self._buffer.reject()


def _identity(camera: Camera1394, settings: DC1394CameraSettings) -> DeviceIdentity:
    rate = "the camera's own" if camera.fps is None else f"{camera.fps:g}"
    shutter = "the camera's own" if settings.shutter_s is None else f"{settings.shutter_s:g} s"
    return DeviceIdentity(
        kind="camera",
        model=camera.model,
        serial=camera.guid,
        address=f"FireWire, S{settings.iso_speed}",
        details={
            "width": str(camera.width),
            "height": str(camera.height),
            "fps": rate,
            "pixel_format": settings.pixel_format,
            "shutter": shutter,
        },
    )


def _waiting(camera: Camera1394) -> Sequence[Image | None]:
    """Return the images that wait, after a moment's wait for a first one."""
    readable, _, _ = select.select([camera.fileno], [], [], _POLL_S)
    return camera.images() if readable else ()


def _check_bus_time(embedded_s: float, camera: Camera1394) -> None:
    """Refuse images whose first pixels are not the time of this bus."""
    age_s = (camera.bus_time().cycle_time_s - embedded_s + _BUS_CLOCK_ERROR_S) % _CYCLE_TIME_WRAP_S
    if age_s > _OLDEST_FIRST_IMAGE_S:
        raise DeviceProtocolError(
            f"camera {camera.guid}: its first image claims to be {age_s:.3f} s old by the bus's clock; its embedded "
            "timestamp is not the bus's cycle time, drop it from embedded_info"
        )


def _silent(camera: Camera1394, silence_s: float) -> DeviceTimeoutError:
    return DeviceTimeoutError(
        f"camera {camera.guid}: sent no image for {silence_s:g} s; check cable, trigger and bandwidth, then close and "
        "connect again"
    )


DRIVER = Driver(
    DC1394CameraSettings, DC1394Camera, lambda settings: CameraSpecification(frames_per_s=settings.fps)
)
