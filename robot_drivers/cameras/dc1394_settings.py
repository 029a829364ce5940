"""How to find a FireWire camera and what it has to deliver."""

import string
from dataclasses import dataclass
from typing import Literal, get_args

from robot_drivers.cameras.embedded_info import ITEMS, EmbeddedItem
from robot_drivers.cameras.pixel_formats import RawPixelFormat
from robot_drivers.errors import ConfigurationError
from robot_drivers.setting_checks import check_positive

_GUID_DIGITS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class DC1394CameraSettings:
    """How to find a FireWire camera and what it has to deliver.

    Attributes
    ----------
    guid : the camera's number, 16 hexadecimal digits; empty takes the only camera there is
    pixel_format : ``"mono8"``, or the Bayer mosaic that the camera has and then sends raw
    width, height, left, top : region of the sensor, px; None for width and height takes all. The bus carries two full
        frames at 25/s, not at 30/s
    fps : images per second, the same for both cameras of a pair: those on one bus then expose together, to 125 µs
    shutter_s, gain_db : exposure; None leaves the camera's own
    embedded_info : the items to switch on in FRAME_INFO, see :mod:`.embedded_info`
    packet_size : bytes in a bus cycle; None takes what ``fps`` needs
    iso_speed : of the bus, Mbit/s
    format7_mode : 0 is the full sensor without binning
    dma_buffers : images that the kernel keeps for a late reader
    buffer_frames : images kept between two reads; then the oldest are lost
    silence_s : longest wait for an image before the stream counts as ended
    library : name or path of the shared library
    """

    guid: str = ""
    pixel_format: RawPixelFormat = "mono8"
    width: int | None = None
    height: int | None = None
    left: int = 0
    top: int = 0
    fps: float | None = None
    shutter_s: float | None = None
    gain_db: float | None = None
    embedded_info: tuple[EmbeddedItem, ...] = ("timestamp", "frame_counter")
    packet_size: int | None = None
    iso_speed: Literal[400, 800] = 800
    format7_mode: int = 0
    dma_buffers: int = 8
    buffer_frames: int = 16
    silence_s: float = 2.0
    library: str = "libdc1394.so.25"

    def __post_init__(self) -> None:
        if self.guid and (len(self.guid) != _GUID_DIGITS or not set(self.guid) <= set(string.hexdigits)):
            raise ConfigurationError(f"guid {self.guid!r}: must be {_GUID_DIGITS} hexadecimal digits")
        if self.pixel_format not in get_args(RawPixelFormat):
            raise ConfigurationError(
                f"pixel_format {self.pixel_format!r}: use one of {', '.join(get_args(RawPixelFormat))}"
            )
        unknown = set(self.embedded_info) - set(ITEMS)
        if unknown or len(set(self.embedded_info)) < len(self.embedded_info):
            raise ConfigurationError(
                f"embedded_info {list(self.embedded_info)}: name each item once, out of {', '.join(ITEMS)}"
            )
        if self.iso_speed not in (400, 800) or not 0 <= self.format7_mode <= 7:
            raise ConfigurationError("iso_speed must be 400 or 800, format7_mode 0..7")
        check_positive(self, "camera", "width", "height", "fps", "shutter_s", "packet_size", "silence_s")
        if self.width is not None and self.width < 4 * len(self.embedded_info):
            raise ConfigurationError(
                f"width {self.width}: too narrow for {list(self.embedded_info)}, 4 px each"
            )
        if min(self.left, self.top) < 0 or min(self.dma_buffers, self.buffer_frames) < 1:
            raise ConfigurationError(
                "left and top must not be negative, dma_buffers and buffer_frames positive"
            )
