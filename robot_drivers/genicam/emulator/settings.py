"""What an emulated GigE Vision camera is like, and what can go wrong with it."""

from dataclasses import dataclass
from typing import Literal

from robot_drivers.emulated_outages import Outages
from robot_drivers.errors import ConfigurationError

PIXEL_FORMATS = {
    "Mono8": 0x01080001,
    "BayerGR8": 0x01080008,
    "BayerRG8": 0x01080009,
    "BayerGB8": 0x0108000A,
    "BayerBG8": 0x0108000B,
    "Mono16": 0x01100007,
    "Coord3D_C16": 0x011000B8,
    "Coord3D_C32f": 0x012000BF,
}
"""Names and numbers of the Pixel Format Naming Convention."""


DEPTH_MODES = ("UncalibratedC", "CalibratedC", "RectifiedC", "DisparityC")
DEPTH_UNITS = ("Millimeter", "Inch", "Pixel")


@dataclass(frozen=True, slots=True, kw_only=True)
class GigEDepthSettings:
    """What the depth images of an emulated camera are like.

    Attributes
    ----------
    depth_format : name of the Pixel Format Naming Convention
    mode : Scan3dOutputMode
    unit : Scan3dDistanceUnit
    scale, offset : Scan3dCoordinateScale and Scan3dCoordinateOffset of a count, in the unit
    invalid : Scan3dInvalidDataValue; None has no such value
    focal_length_px, principal_point_px : of the image
    extended_ids : whether blocks have numbers of 64 bits at power-up
    """

    depth_format: Literal["Coord3D_C16", "Coord3D_C32f"] = "Coord3D_C16"
    mode: Literal["UncalibratedC", "CalibratedC", "RectifiedC", "DisparityC"] = "CalibratedC"
    unit: Literal["Millimeter", "Inch", "Pixel"] = "Millimeter"
    scale: float = 0.02
    offset: float = 0.0
    invalid: int | None = 0
    focal_length_px: float = 300.0
    principal_point_px: tuple[float, float] = (79.5, 59.5)
    extended_ids: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class GigECameraSettings:
    """What the emulated camera is like.

    Attributes
    ----------
    host : address that it listens at, on UDP port 3956 as all do
    width, height, fps, pixel_format : of its images, px and 1/s
    vendor, model, serial : what it tells about itself
    chunks : whether it can append a time to its images
    ptp : what becomes of its clock once PTP is switched on: a slave of this computer's, a master, or neither; "absent"
        knows no PTP
    ptp_settle_s : how long it takes to become a slave
    clock_ppm : how much faster than the host's its own clock runs, 1e-6
    readout_s : from an exposure until its image begins to leave the camera, as long as it is there by then
    depth : what it can send beside its images; None for a camera without depth
    """

    host: str = "127.0.0.1"
    width: int = 160
    height: int = 120
    fps: float = 50.0
    pixel_format: str = "Mono8"
    vendor: str = "Emulated"
    model: str = "GigE"
    serial: str = "E0001"
    chunks: bool = True
    ptp: Literal["absent", "slave", "master", "never"] = "slave"
    ptp_settle_s: float = 0.2
    clock_ppm: float = 0.0
    readout_s: float = 0.0
    depth: GigEDepthSettings | None = None

    def __post_init__(self) -> None:
        if self.pixel_format not in PIXEL_FORMATS:
            raise ConfigurationError(
                f"pixel_format {self.pixel_format!r}: must be one of {', '.join(PIXEL_FORMATS)}"
            )

    @property
    def image_bytes(self) -> int:
        """Bytes of one image."""
        return self.width * self.height * _bits(self.pixel_format) // 8

    @property
    def depth_bytes(self) -> int:
        """Bytes of one image of depth."""
        return 0 if self.depth is None else self.width * self.height * _bits(self.depth.depth_format) // 8


@dataclass(frozen=True, slots=True, kw_only=True)
class GigEFaults(Outages):
    """Departures from a healthy camera and network; the default is none. Times count from the injection.

    Attributes
    ----------
    loss : probability for each image to be lost altogether
    packet_loss : probability for each image that one of its packets is lost
    stalled : it answers, and sends no image
    unplug_at_s, unplug_for_s : the cable is out meanwhile
    restart_at_s, restart_for_s : the camera has no power meanwhile, and then begins as new
    """

    loss: float = 0.0
    packet_loss: float = 0.0
    stalled: bool = False


def _bits(pixel_format: str) -> int:
    return PIXEL_FORMATS[pixel_format] >> 16 & 0xFF
