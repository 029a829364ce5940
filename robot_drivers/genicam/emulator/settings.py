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
}
"""Names and numbers of the Pixel Format Naming Convention."""


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

    def __post_init__(self) -> None:
        if self.pixel_format not in PIXEL_FORMATS:
            raise ConfigurationError(
                f"pixel_format {self.pixel_format!r}: must be one of {', '.join(PIXEL_FORMATS)}"
            )

    @property
    def image_bytes(self) -> int:
        """Bytes of one image."""
        return self.width * self.height * (PIXEL_FORMATS[self.pixel_format] >> 16 & 0xFF) // 8


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
