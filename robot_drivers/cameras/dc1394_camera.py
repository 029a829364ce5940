"""One FireWire camera through libdc1394: found, set up, started; its frames and its bus's clock."""

import contextlib
import ctypes
import math
from collections.abc import Sequence
from ctypes import byref, c_float, c_int, c_uint32, c_uint64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robot_drivers.cameras import dc1394_library as lib
from robot_drivers.cameras.dc1394_settings import DC1394CameraSettings
from robot_drivers.cameras.embedded_info import ITEMS, EmbeddedItem, cycle_time_s
from robot_drivers.clock import host_time_ns, wall_to_monotonic_offset_ns
from robot_drivers.errors import ConfigurationError, DeviceProtocolError, DeviceUnreachableError

_FRAME_INFO = 0x12F8
_FRAME_INFO_PRESENT = 0x8000_0000
_CYCLES_PER_SECOND = 8000
_PLAUSIBLE_AGE_NS = 1_000_000_000
_FILTERS = {
    "bayer_rggb8": lib.FILTER_RGGB,
    "bayer_gbrg8": lib.FILTER_GBRG,
    "bayer_grbg8": lib.FILTER_GRBG,
    "bayer_bggr8": lib.FILTER_BGGR,
}
_RATE_TOLERANCE = 0.02


@dataclass(frozen=True, slots=True)
class Image:
    """One image as it came: pixels (height, width), receive stamp of the kernel on the host clock, ns."""

    pixels: NDArray[np.uint8]
    host_time_ns: int


@dataclass(frozen=True, slots=True)
class BusTime:
    """The bus's cycle time, s (it wraps at 128 s), and the host time at which it was read, ns."""

    cycle_time_s: float
    host_time_ns: int


class Camera1394:
    """A camera that transmits from construction to :meth:`close`.

    Attributes
    ----------
    guid, model : who it is
    width, height : of its images, px
    packet_size : bytes in each of the 8000 bus cycles of a second that carry an image
    fps : images per second, as the camera tells; None where it does not

    Raises
    ------
    DeviceUnreachableError
        There is no such camera on any bus.
    ConfigurationError
        The camera cannot be set as wanted.
    DeviceFaultError
        The library reports an error.
    """

    def __init__(self, library: lib.DC1394Library, settings: DC1394CameraSettings) -> None:
        self._library = library
        self._settings = settings
        self._mode = lib.FORMAT7_0 + settings.format7_mode
        with contextlib.ExitStack() as on_failure:
            context = library.plain("dc1394_new")
            if not context:
                raise DeviceUnreachableError(
                    "there is no FireWire bus that may be used: check the adapter, and access to /dev/fw*"
                )
            on_failure.callback(library.plain, "dc1394_free", context)
            self._camera = self._open(context)
            on_failure.callback(library.plain, "dc1394_camera_free", self._camera)
            about = self._camera.contents
            self.guid = f"{about.guid:016x}"
            self.model = f"{_text(about.vendor)} {_text(about.model)}".strip()
            self._set_up(bool(about.bmode_capable))
            library.call(
                "dc1394_capture_setup", self._camera, settings.dma_buffers, lib.CAPTURE_FLAGS_DEFAULT
            )
            on_failure.callback(library.plain, "dc1394_capture_stop", self._camera)
            library.call("dc1394_video_set_transmission", self._camera, lib.ON)
            on_failure.callback(library.plain, "dc1394_video_set_transmission", self._camera, lib.OFF)
            self._resources = on_failure.pop_all()

    @property
    def fileno(self) -> int:
        """A file descriptor that is readable when an image waits."""
        return int(self._library.plain("dc1394_capture_get_fileno", self._camera))

    def images(self) -> Sequence[Image | None]:
        """Take all images that wait; None stands for one that arrived damaged."""
        taken: list[Image | None] = []
        frame = ctypes.POINTER(lib.VideoFrame)()
        while True:
            self._library.call("dc1394_capture_dequeue", self._camera, lib.CAPTURE_POLL, byref(frame))
            if not frame:
                return taken
            try:
                damaged = self._library.plain("dc1394_capture_is_frame_corrupt", self._camera, frame)
                taken.append(None if damaged else self._image(frame.contents))
            finally:
                self._library.call("dc1394_capture_enqueue", self._camera, frame)

    def bus_time(self) -> BusTime:
        """Read the bus's cycle timer and the host clock together: the two ends of the cameras' time stamps."""
        quadlet, wall_us = c_uint32(), c_uint64()
        self._library.call("dc1394_read_cycle_timer", self._camera, byref(quadlet), byref(wall_us))
        return BusTime(cycle_time_s(quadlet.value), wall_us.value * 1000 + wall_to_monotonic_offset_ns())

    def close(self) -> None:
        """End the transmission and release camera and bus."""
        self._resources.close()

    def _open(self, context: int) -> Any:
        """Return the camera that the settings name, or the only one."""
        cameras = ctypes.POINTER(lib.CameraList)()
        self._library.call("dc1394_camera_enumerate", context, byref(cameras))
        found = [cameras.contents.ids[n].guid for n in range(cameras.contents.num)]
        self._library.plain("dc1394_camera_free_list", cameras)
        there = ", ".join(f"{guid:016x}" for guid in found) or "none"
        if not self._settings.guid and len(found) > 1:
            raise ConfigurationError(f"several FireWire cameras are there ({there}): set guid to one of them")
        wanted = int(self._settings.guid, 16) if self._settings.guid else (found or [0])[0]
        camera = self._library.plain("dc1394_camera_new", context, wanted) if wanted in found else None
        if not camera:
            raise DeviceUnreachableError(
                f"no FireWire camera {self._settings.guid or 'at all'}; those there: {there}. Check cable, power and "
                "access to /dev/fw*"
            )
        return camera

    def _set_up(self, bmode_capable: bool) -> None:
        settings, library, camera = self._settings, self._library, self._camera
        if settings.iso_speed == max(lib.ISO_SPEEDS):
            if not bmode_capable:
                raise ConfigurationError(f"camera {self.guid} cannot run at S800: set iso_speed to 400")
            library.call("dc1394_video_set_operation_mode", camera, lib.OPERATION_1394B)
        library.call("dc1394_video_set_iso_speed", camera, lib.ISO_SPEEDS[settings.iso_speed])
        library.call("dc1394_video_set_mode", camera, self._mode)
        self._set_region()
        self._set_feature(lib.FEATURE_FRAME_RATE, settings.fps)
        self._set_feature(lib.FEATURE_SHUTTER, settings.shutter_s)
        self._set_feature(lib.FEATURE_GAIN, settings.gain_db)
        self.fps = self._frame_rate()
        self._set_frame_info(settings.embedded_info)

    def _set_region(self) -> None:
        settings, library, camera = self._settings, self._library, self._camera
        width, height = c_uint32(), c_uint32()
        library.call("dc1394_format7_get_max_image_size", camera, self._mode, byref(width), byref(height))
        self.width = settings.width or width.value - settings.left
        self.height = settings.height or height.value - settings.top
        self.packet_size = self._packet_size()
        coding = lib.CODING_MONO8 if settings.pixel_format == "mono8" else lib.CODING_RAW8
        region = (settings.left, settings.top, self.width, self.height)
        library.call("dc1394_format7_set_roi", camera, self._mode, coding, self.packet_size, *region)
        if settings.pixel_format != "mono8":
            self._check_filter(_FILTERS[settings.pixel_format])

    def _packet_size(self) -> int:
        """Return the smallest packet that carries the images at the frame rate: both cameras share the bus."""
        if self._settings.packet_size is not None:
            return self._settings.packet_size
        if self._settings.fps is None:
            return lib.RECOMMENDED_PACKET
        unit, largest = c_uint32(), c_uint32()
        self._library.call(
            "dc1394_format7_get_packet_parameters", self._camera, self._mode, byref(unit), byref(largest)
        )
        needed = self.width * self.height * self._settings.fps / _CYCLES_PER_SECOND
        size = max(unit.value, 1) * math.ceil(needed / max(unit.value, 1))
        if size > largest.value:
            raise ConfigurationError(
                f"camera {self.guid}: {self.width}x{self.height} at {self._settings.fps:g}/s need packets of {size} "
                f"bytes, it can send {largest.value}; lower fps or height"
            )
        return size

    def _check_filter(self, wanted: int) -> None:
        stated = c_int()
        self._library.call("dc1394_format7_get_color_filter", self._camera, self._mode, byref(stated))
        if stated.value != wanted:
            names = {number: name for name, number in _FILTERS.items()}
            raise ConfigurationError(
                f"camera {self.guid} has the mosaic {names.get(stated.value, stated.value)}, not "
                f"{self._settings.pixel_format}; set pixel_format to it"
            )

    def _set_feature(self, feature: int, value: float | None) -> None:
        if value is None:
            return
        library, camera = self._library, self._camera
        library.call("dc1394_feature_set_power", camera, feature, lib.ON)
        library.call("dc1394_feature_set_mode", camera, feature, lib.FEATURE_MODE_MANUAL)
        library.call("dc1394_feature_set_absolute_control", camera, feature, lib.ON)
        library.call("dc1394_feature_set_absolute_value", camera, feature, value)

    def _frame_rate(self) -> float | None:
        wanted, stated = self._settings.fps, c_float()
        if wanted is None:
            return None
        self._library.call(
            "dc1394_feature_get_absolute_value", self._camera, lib.FEATURE_FRAME_RATE, byref(stated)
        )
        if abs(stated.value - wanted) > _RATE_TOLERANCE * wanted:
            raise ConfigurationError(
                f"camera {self.guid}: fps {wanted:g} was requested, but the camera stays at {stated.value:g}; request "
                "what it offers"
            )
        return stated.value

    def _set_frame_info(self, items: Sequence[EmbeddedItem]) -> None:
        wanted = _FRAME_INFO_PRESENT | sum(1 << ITEMS.index(item) for item in items)
        value = c_uint32(wanted)
        self._library.call("dc1394_set_control_registers", self._camera, _FRAME_INFO, byref(value), 1)
        self._library.call("dc1394_get_control_registers", self._camera, _FRAME_INFO, byref(value), 1)
        if value.value != wanted:
            raise ConfigurationError(
                f"camera {self.guid} does not embed {list(items)} (FRAME_INFO is {value.value:#010x} instead of "
                f"{wanted:#010x}); drop what it lacks from embedded_info"
            )

    def _image(self, frame: lib.VideoFrame) -> Image:
        width, height = tuple(frame.size)
        if (width, height) != (self.width, self.height) or frame.stride < width:
            raise DeviceProtocolError(
                f"camera {self.guid} sent {width}x{height} px instead of {self.width}x{self.height}"
            )
        rows = np.ctypeslib.as_array(frame.image, (height, frame.stride))
        now_ns = host_time_ns()
        stamp_ns = frame.timestamp * 1000 + wall_to_monotonic_offset_ns()
        plausible = 0 <= now_ns - stamp_ns <= _PLAUSIBLE_AGE_NS
        return Image(rows[:, :width].copy(), stamp_ns if plausible else now_ns)


def _text(words: bytes | None) -> str:
    return (words or b"").decode(errors="replace")
