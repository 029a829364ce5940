"""The driver of a GenICam camera: a thread takes its images, numbers and times them."""

from robot_drivers.cameras.frame_buffer import FrameBuffer
from robot_drivers.cameras.streamed_camera import StreamedCamera
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceProtocolError, DeviceTimeoutError
from robot_drivers.genicam.aravis_library import AravisLibrary
from robot_drivers.genicam.device import DamagedImage, Device, Image
from robot_drivers.genicam.settings import GenICamSettings
from robot_drivers.protocols import DeviceIdentity

_LOOK_S = 0.05
_NUMBERS = 0xFFFF  # 0 is no number of an image


class FrameNumbers:
    """Numbers of images without an end, from those of 16 bits that begin again at 1, or of 64 bits."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._counter = 0

    def step(self, number: int) -> int:
        """Take the number of the next image; return how many images it is after the one before, 0 for the first."""
        last, self._last = self._last, number
        if last is None:
            return 0
        step = number - last if max(number, last) > _NUMBERS else (number - last) % _NUMBERS
        self._counter += step
        return step

    @property
    def counter(self) -> int:
        """Of the image taken last, from 0."""
        return self._counter


class GenICamCamera(StreamedCamera[Device]):
    """A camera through Aravis.

    In :meth:`statistics`, ``lost`` counts images that the camera's numbers prove missing and those that gave way in a
    full buffer, ``malformed`` those of which a packet is missing.
    """

    def __init__(self, settings: GenICamSettings) -> None:
        super().__init__(
            f"camera {settings.camera}",
            lambda: FrameBuffer(settings.buffer_frames, settings.pixel_format, ()),
        )
        self._settings = settings
        self._numbers = FrameNumbers()

    def _open(self) -> Device:
        self._numbers = FrameNumbers()
        library = AravisLibrary(self._settings.library, parts=self._settings.depth)
        return Device(library, self._settings)

    def _begin(self, source: Device) -> DeviceIdentity:
        self._await_first(source)
        return self._describe(source)

    def _release(self, source: Device) -> None:
        source.close()

    def _describe(self, device: Device) -> DeviceIdentity:
        times = "chunks" if self._settings.chunk_timestamps else "stream"
        details = {
            "width": str(device.width),
            "height": str(device.height),
            "pixel_format": self._settings.pixel_format,
            "times": times,
        }
        if device.fps is not None:
            details["fps"] = f"{device.fps:g}"
        if device.ptp:
            details["PTP"] = device.ptp
        if device.depth is not None:
            details |= device.depth.details()
        return DeviceIdentity(
            kind="camera",
            model=device.model,
            serial=device.serial,
            address=self._settings.camera,
            details=details,
        )

    def _await_first(self, device: Device) -> None:
        deadline_ns = host_time_ns() + round(self._settings.open_timeout_s * 1e9)
        while not self._take(device):
            if host_time_ns() > deadline_ns:
                raise DeviceTimeoutError(
                    f"camera {self._settings.camera} answers, but sends no image in "
                    f"{self._settings.open_timeout_s:g} s: check the firewall, packet_size, and that it awaits no "
                    "trigger"
                )

    def _run(self, source: Device) -> None:
        last_ns = host_time_ns()
        while not self._stopping.is_set():
            if self._take(source):
                last_ns = host_time_ns()
            elif host_time_ns() - last_ns > self._settings.silence_s * 1e9:
                self._buffer.fail(
                    DeviceTimeoutError(
                        f"camera {self._settings.camera}: the stream was silent for {self._settings.silence_s:g} s; "
                        "check cable and power, then close and connect again"
                    )
                )
                return

    def _take(self, device: Device) -> bool:
        """Take an image; tell whether a whole one came."""
        try:
            image = device.image(_LOOK_S)
        except DeviceProtocolError:
            self._buffer.reject()
            return False
        if isinstance(image, DamagedImage):
            self._buffer.reject()
            self._buffer.miss(max(0, self._numbers.step(image.number) - 1))
        if not isinstance(image, Image):
            return False
        self._buffer.miss(max(0, self._numbers.step(image.number) - 1))
        self._buffer.add(
            image.pixels, image.host_time_ns, self._numbers.counter, image.device_time_s, image.depth
        )
        return True
