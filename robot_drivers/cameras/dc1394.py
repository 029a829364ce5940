"""FireWire (IIDC) cameras through libdc1394, an optional library: ``apt install libdc1394-25``.

No OpenCV wheel opens such a camera. Through this driver the image arrives untouched, with the counter and the bus's
cycle time that the camera embeds in its first pixels, and with the kernel's receive stamp.
"""

import select
import threading
import time
from collections.abc import Sequence

from robot_drivers.cameras.dc1394_camera import BusTime, Camera1394, Image
from robot_drivers.cameras.dc1394_library import DC1394Library
from robot_drivers.cameras.dc1394_settings import DC1394CameraSettings
from robot_drivers.cameras.frame_buffer import FrameBuffer
from robot_drivers.driver import Driver
from robot_drivers.errors import DeviceError, DeviceProtocolError, DeviceTimeoutError
from robot_drivers.protocols import DeviceIdentity, Frame, StreamStatistics
from robot_drivers.specification import CameraSpecification

__all__ = ["DRIVER", "BusTime", "DC1394Camera", "DC1394CameraSettings"]

_POLL_S = 0.1
_CYCLE_TIME_WRAP_S = 128.0
_OLDEST_FIRST_IMAGE_S = 5.0
_BUS_CLOCK_ERROR_S = 0.01


class DC1394Camera:
    """A :class:`robot_drivers.protocols.Camera` on a FireWire bus.

    :meth:`connect` returns with the first image in the buffer. A camera that falls silent or is unplugged makes
    :meth:`read` raise once the buffer is empty; :meth:`close` and :meth:`connect` start over.
    """

    def __init__(self, settings: DC1394CameraSettings) -> None:
        self._settings = settings
        self._camera: Camera1394 | None = None
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._buffer = self._empty_buffer()

    @property
    def identity(self) -> DeviceIdentity:
        """Who is connected; raises DeviceError before :meth:`connect`."""
        camera, settings = self._connected(), self._settings
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

    def connect(self) -> None:
        """Find the camera, set it up, check its time stamps against the bus's clock, and start receiving.

        Raises
        ------
        ConfigurationError
            The library is not there, or the camera cannot be set as wanted.
        DeviceUnreachableError
            There is no such camera.
        DeviceTimeoutError
            It was set up and sends no image.
        DeviceProtocolError
            Its images do not hold the bus's time.
        DeviceFaultError
            The library reports an error.
        """
        if self._camera is not None:
            raise DeviceError(f"camera {self._camera.guid}: already connected; close it first")
        self._stopping.clear()
        self._buffer = self._empty_buffer()
        camera = Camera1394(DC1394Library(self._settings.library), self._settings)
        try:
            first = self._wait_for_image(camera)
            if first.device_time_s is not None:
                _check_bus_time(first.device_time_s, camera)
        except BaseException:
            camera.close()
            raise
        self._camera = camera
        self._thread = threading.Thread(target=self._run, args=(camera,), name=f"camera {camera.guid}")
        self._thread.start()

    def read(self, timeout_s: float) -> list[Frame]:
        """Return the images since the last call, oldest first; wait up to ``timeout_s`` for a first one.

        Raises
        ------
        DeviceTimeoutError, DeviceFaultError
            The camera has fallen silent or is gone, and every image before that was read.
        """
        return self._buffer.read(timeout_s)

    def statistics(self) -> StreamStatistics:
        """Return the counts since :meth:`connect`; ``malformed`` are images that arrived damaged."""
        return self._buffer.statistics

    def bus_time(self) -> BusTime:
        """Read the bus's cycle timer and the host clock together.

        Device times of images are the cycle time, unwrapped, so this maps them to the host clock from both sides.
        """
        return self._connected().bus_time()

    def close(self) -> None:
        """Stop the camera and release it."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._camera is not None:
            self._camera.close()
            self._camera = None

    def _connected(self) -> Camera1394:
        if self._camera is None:
            raise DeviceError("FireWire camera: not connected; call connect() first")
        return self._camera

    def _empty_buffer(self) -> FrameBuffer:
        settings = self._settings
        return FrameBuffer(settings.buffer_frames, settings.pixel_format, settings.embedded_info)

    def _wait_for_image(self, camera: Camera1394) -> Frame:
        deadline = time.monotonic() + self._settings.silence_s
        while time.monotonic() < deadline:
            frames = [self._keep(image) for image in _waiting(camera) if image is not None]
            if frames:
                return frames[-1]
        raise _silent(camera, self._settings.silence_s)

    def _run(self, camera: Camera1394) -> None:
        last_sign = time.monotonic()
        while not self._stopping.is_set():
            try:
                images = _waiting(camera)
            except DeviceError as error:
                self._buffer.fail(error)
                return
            for image in images:
                self._keep_or_reject(image)
                last_sign = time.monotonic()
            if time.monotonic() - last_sign > self._settings.silence_s:
                self._buffer.fail(_silent(camera, self._settings.silence_s))
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
