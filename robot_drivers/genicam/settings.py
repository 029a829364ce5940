"""How to reach a GenICam camera, and what it has to deliver."""

from dataclasses import dataclass

from robot_drivers.cameras.pixel_formats import RawPixelFormat
from robot_drivers.errors import ConfigurationError
from robot_drivers.setting_checks import check_positive

PIXEL_FORMATS: dict[str, str] = {
    "mono8": "Mono8",
    "bayer_rggb8": "BayerRG8",
    "bayer_grbg8": "BayerGR8",
    "bayer_gbrg8": "BayerGB8",
    "bayer_bggr8": "BayerBG8",
}
"""The project's names, and those of the Pixel Format Naming Convention."""

_SMALLEST_PACKET, _LARGEST_PACKET = 576, 16384


@dataclass(frozen=True, slots=True, kw_only=True)
class GenICamSettings:
    """How to reach one camera, and what it has to deliver.

    The camera keeps its own settings (region, exposure, gain, trigger), which its maker's program saves in it; what is
    stated here and differs is refused. Only ``depth``, ``chunk_timestamps``, ``ptp`` and ``packet_size`` change
    anything in it.

    Attributes
    ----------
    camera : its IPv4 address, serial number or name
    pixel_format : mono8 or a Bayer mosaic; images come through bit for bit, (height, width)
    width, height, fps : what they have to be, px and 1/s; None takes any
    depth : take with each image one of depth, of the same pixels (GenICam's components Intensity and Range, the latter
        as Coord3D_C16). Both, and their transfer as parts of one block, are switched on
    chunk_timestamps : take the times from the chunk that the camera appends to each image, which is switched on;
        otherwise those of the stream
    ptp : let its clock follow that of the network (IEEE 1588), which is switched on, so that several cameras have one
        clock. :meth:`connect` waits until it does
    ptp_timeout_s : longest wait for that
    packet_size : bytes of its datagrams, 9000 where the network takes jumbo frames; None leaves it to Aravis
    buffer_frames : images kept between two reads; then the oldest gives way
    open_timeout_s : longest wait for the first image
    silence_s : longest silence before the stream counts as ended
    library : Aravis' shared library
    """

    camera: str
    pixel_format: RawPixelFormat = "mono8"
    width: int | None = None
    height: int | None = None
    fps: float | None = None
    depth: bool = False
    chunk_timestamps: bool = False
    ptp: bool = False
    ptp_timeout_s: float = 20.0
    packet_size: int | None = None
    buffer_frames: int = 16
    open_timeout_s: float = 5.0
    silence_s: float = 2.0
    library: str = "libaravis-0.8.so.0"

    def __post_init__(self) -> None:
        if not self.camera:
            raise ConfigurationError("camera: name its IPv4 address, its serial number or its name")
        if self.pixel_format not in PIXEL_FORMATS:
            raise ConfigurationError(
                f"pixel_format {self.pixel_format!r}: use one of {', '.join(PIXEL_FORMATS)}"
            )
        if self.depth and self.chunk_timestamps:
            raise ConfigurationError(
                "chunk_timestamps: of a camera that sends depth the times are those of the stream; leave it out"
            )
        check_positive(self, "camera", "fps", "ptp_timeout_s", "open_timeout_s", "silence_s")
        for name in ("width", "height", "buffer_frames"):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise ConfigurationError(f"{name} {value}: must be 1 or more")
        size = self.packet_size
        if size is not None and not (_SMALLEST_PACKET <= size <= _LARGEST_PACKET and size % 4 == 0):
            raise ConfigurationError(
                f"packet_size {size}: must be a multiple of 4 in {_SMALLEST_PACKET}..{_LARGEST_PACKET}"
            )
