"""One camera through Aravis: found, checked, started; its images with the camera's number and time."""

import contextlib
import ctypes
import time
from ctypes import byref, c_int, c_size_t
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.clock import host_time_ns, host_times_ns, wall_to_monotonic_offset_ns
from robot_drivers.errors import (
    ConfigurationError,
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.genicam.aravis_library import BUFFER_SUCCESS, AravisLibrary
from robot_drivers.genicam.depth import DepthComponent, parts_of
from robot_drivers.genicam.parts import image_and_depth
from robot_drivers.genicam.settings import PIXEL_FORMATS, GenICamSettings
from robot_drivers.protocols import DepthImage

_CHUNK, _CHUNK_TIMESTAMP = b"Timestamp", b"ChunkTimestamp"
_PTP = (("PtpEnable", "PtpStatus"), ("GevIEEE1588", "GevIEEE1588Status"))
_FOLLOWING, _LEADING = "Slave", "Master"
_PTP_LOOK_S = 0.05
_RATE_TOLERANCE = 0.02
_PLAUSIBLE_AGE_NS = 1_000_000_000
_BUFFERS = 16


@dataclass(frozen=True, slots=True)
class Image:
    """One image as it came.

    Attributes
    ----------
    pixels : (height, width)
    depth : of the same pixels; None where none was asked for
    number : the camera's, 1..65535 and again from 1; or of 64 bits
    device_time_s : the camera's clock at the exposure
    host_time_ns : receive stamp of its first packet, on the host clock
    """

    pixels: NDArray[np.uint8]
    depth: DepthImage | None
    number: int
    device_time_s: float
    host_time_ns: int


@dataclass(frozen=True, slots=True)
class DamagedImage:
    """An image of which not every packet arrived; ``number`` as of :class:`Image`."""

    number: int


class Device:
    """A camera that transmits from construction to :meth:`close`.

    Attributes
    ----------
    model, serial : who it is
    width, height : of its images, px
    fps : images a second, as it tells; None where it does not
    depth : what it tells of its depth images; None where none were asked for
    ptp : what its clock is to the network's: "Slave", "Master"; empty where PTP was not asked for

    Raises
    ------
    DeviceUnreachableError
        There is no such camera.
    ConfigurationError
        The camera is not set as wanted, or cannot do what is wanted.
    DeviceTimeoutError
        Its clock does not follow the network's.
    DeviceFaultError
        Aravis reports an error.
    """

    def __init__(self, library: AravisLibrary, settings: GenICamSettings) -> None:
        self._library = library
        self._settings = settings
        self._parser = 0
        with contextlib.ExitStack() as on_failure:
            self._camera = self._open()
            on_failure.callback(library.release, self._camera)
            vendor = library.text("arv_camera_get_vendor_name", self._camera)
            self.model = f"{vendor} {library.text('arv_camera_get_model_name', self._camera)}".strip()
            self.serial = library.text("arv_camera_get_device_serial_number", self._camera)
            self.depth = (
                DepthComponent.switched_on(library, self._camera, settings.camera) if settings.depth else None
            )
            self._check_images()
            self.ptp = self._follow_network_time() if settings.ptp else ""
            if settings.chunk_timestamps:
                self._switch_chunks_on()
                self._parser = library.plain("arv_camera_create_chunk_parser", self._camera)
                on_failure.callback(library.release, self._parser)
            self._stream = self._stream_of_buffers()
            on_failure.callback(library.release, self._stream)
            library.call("arv_camera_start_acquisition", self._camera)
            on_failure.callback(self._stop)
            self._resources = on_failure.pop_all()

    def image(self, timeout_s: float) -> Image | DamagedImage | None:
        """Return the next image; None where none came in time.

        Raises
        ------
        DeviceProtocolError
            It is of another size than the camera told, or without the time or the depth that was asked for.
        """
        buffer = self._library.plain(
            "arv_stream_timeout_pop_buffer", self._stream, max(0, round(timeout_s * 1e6))
        )
        if not buffer:
            return None
        try:
            return self._taken(buffer)
        finally:
            self._library.plain("arv_stream_push_buffer", self._stream, buffer)

    def close(self) -> None:
        """End the transmission and release the camera."""
        self._resources.close()

    def _open(self) -> int:
        name = self._settings.camera
        try:
            return int(self._library.call("arv_camera_new", name.encode()) or 0) or self._nobody("not found")
        except DeviceFaultError as error:
            return self._nobody(str(error))

    def _nobody(self, words: str) -> int:
        raise DeviceUnreachableError(
            f"no GenICam camera {self._settings.camera} ({words}): check power, cable, address, and that the firewall "
            "lets UDP port 3956 through"
        )

    def _check_images(self) -> None:
        library, settings = self._library, self._settings
        told = library.text("arv_camera_get_pixel_format_as_string", self._camera)
        if told != PIXEL_FORMATS[settings.pixel_format]:
            self._refuse(f"sends {told}, not {PIXEL_FORMATS[settings.pixel_format]}", "pixel_format")
        left, top, width, height = c_int(), c_int(), c_int(), c_int()
        places = (byref(left), byref(top), byref(width), byref(height))
        library.call("arv_camera_get_region", self._camera, *places)
        self.width, self.height = width.value, height.value
        wanted = (settings.width or self.width, settings.height or self.height)
        if wanted != (self.width, self.height):
            self._refuse(
                f"sends {self.width}x{self.height} px, not {wanted[0]}x{wanted[1]}", "width and height"
            )
        self.fps = self._frame_rate()
        if settings.fps is not None and (
            self.fps is None or abs(self.fps - settings.fps) > _RATE_TOLERANCE * settings.fps
        ):
            self._refuse(f"tells {self.fps or 'no'} images a second, not {settings.fps:g}", "fps")

    def _refuse(self, what: str, setting: str) -> None:
        raise ConfigurationError(
            f"camera {self._settings.camera} {what}: set it with its maker's program, or {setting} to what it has"
        )

    def _frame_rate(self) -> float | None:
        try:
            return float(self._library.call("arv_camera_get_frame_rate", self._camera)) or None
        except DeviceFaultError:
            return None

    def _has(self, feature: str) -> bool:
        return bool(self._library.call("arv_camera_is_feature_available", self._camera, feature.encode()))

    def _follow_network_time(self) -> str:
        """Switch PTP on and wait until the camera's clock is the network's; return which side it is on."""
        library, settings = self._library, self._settings
        names = next((names for names in _PTP if all(map(self._has, names))), None)
        if names is None:
            raise ConfigurationError(f"camera {settings.camera} knows no PTP: leave ptp out")
        enable, status = (name.encode() for name in names)
        if not library.call("arv_camera_get_boolean", self._camera, enable):
            library.call("arv_camera_set_boolean", self._camera, enable, 1)
        deadline_ns = host_time_ns() + round(settings.ptp_timeout_s * 1e9)
        while (side := library.text("arv_camera_get_string", self._camera, status)) not in (
            _FOLLOWING,
            _LEADING,
        ):
            if host_time_ns() > deadline_ns:
                raise DeviceTimeoutError(
                    f"camera {settings.camera} follows no clock of the network after {settings.ptp_timeout_s:g} s (PTP "
                    f"status {side}): start a PTP master, such as ptp4l on this computer, or leave ptp out"
                )
            time.sleep(_PTP_LOOK_S)
        return side

    def _switch_chunks_on(self) -> None:
        try:
            self._library.call("arv_camera_set_chunks", self._camera, _CHUNK)
        except DeviceFaultError as error:
            raise ConfigurationError(
                f"camera {self._settings.camera} appends no time to its images ({error}): leave chunk_timestamps out"
            ) from error

    def _stream_of_buffers(self) -> int:
        library, settings = self._library, self._settings
        if settings.packet_size is not None and library.plain("arv_camera_is_gv_device", self._camera):
            library.call("arv_camera_gv_set_packet_size", self._camera, settings.packet_size)
        stream = int(library.call("arv_camera_create_stream", self._camera, None, None))
        size = library.call("arv_camera_get_payload", self._camera)
        for _ in range(_BUFFERS):
            library.plain("arv_stream_push_buffer", stream, library.plain("arv_buffer_new", size, None))
        return stream

    def _stop(self) -> None:
        with contextlib.suppress(DeviceFaultError):  # a camera that is gone has stopped
            self._library.call("arv_camera_stop_acquisition", self._camera)

    def _taken(self, buffer: int) -> Image | DamagedImage:
        library = self._library
        number = int(library.plain("arv_buffer_get_frame_id", buffer))
        if library.plain("arv_buffer_get_status", buffer) != BUFFER_SUCCESS:
            return DamagedImage(number)
        size = c_size_t()
        data = library.plain("arv_buffer_get_data", buffer, byref(size))
        content = np.ctypeslib.as_array(ctypes.cast(data, ctypes.POINTER(ctypes.c_uint8)), (size.value,))
        now_ns = host_time_ns()
        stamp_ns = self._arrived_ns(buffer)
        plausible = 0 <= now_ns - stamp_ns <= _PLAUSIBLE_AGE_NS
        return Image(
            *self._pixels(buffer, content),
            number,
            self._device_time_ns(buffer) * 1e-9,
            stamp_ns if plausible else now_ns,
        )

    def _arrived_ns(self, buffer: int) -> int:
        """Return when the first packet came, host clock."""
        wall_ns = self._library.plain("arv_buffer_get_system_timestamp", buffer)
        return int(host_times_ns(np.array([wall_ns + wall_to_monotonic_offset_ns()]))[0])

    def _pixels(self, buffer: int, content: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], DepthImage | None]:
        """Return copies of the image, and of that of depth, in the bytes of a buffer."""
        if self.depth is not None:
            parts = parts_of(self._library, buffer)
            pixels, counts = image_and_depth(content, parts, (self.width, self.height))
            return pixels, DepthImage(counts, self.depth.scale)
        width = self._library.plain("arv_buffer_get_image_width", buffer)
        height = self._library.plain("arv_buffer_get_image_height", buffer)
        if (width, height) != (self.width, self.height) or content.size < width * height:
            raise DeviceProtocolError(
                f"camera {self._settings.camera} sent {width}x{height} px in {content.size} bytes instead of "
                f"{self.width}x{self.height}"
            )
        return content[: width * height].reshape(height, width).copy(), None

    def _device_time_ns(self, buffer: int) -> int:
        if not self._parser:
            return int(self._library.plain("arv_buffer_get_timestamp", buffer))
        try:
            return int(
                self._library.call(
                    "arv_chunk_parser_get_integer_value", self._parser, buffer, _CHUNK_TIMESTAMP
                )
            )
        except DeviceFaultError as error:
            raise DeviceProtocolError(
                f"camera {self._settings.camera} sent an image without its time: {error}"
            ) from error
