"""What OpenCV can open, how, and whether it delivers what was asked for."""

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from robot_drivers.cameras.embedded_info import ITEMS, EmbeddedItem
from robot_drivers.cameras.pixel_formats import PIXEL_FORMATS, PixelFormat
from robot_drivers.errors import ConfigurationError, DeviceUnreachableError
from robot_drivers.protocols import DeviceIdentity

Backend = Literal[
    "any", "ffmpeg", "images", "v4l2", "gstreamer", "firewire", "aravis", "msmf", "dshow", "avfoundation"
]

_FPS_TOLERANCE = 0.01

# FFmpeg writes to standard error for itself, unless told otherwise before OpenCV first uses it (-8 is AV_LOG_QUIET);
# what matters is told by this driver.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
_GREY_CODES = (b"GREY", b"Y800")


@dataclass(frozen=True, slots=True)
class OpenCVCameraSettings:
    """How to open a camera and what it has to deliver.

    Attributes
    ----------
    source : device index ("0"), video file, image sequence ("images/%04d.png") or URL ("tcp://host:port")
    backend : the one OpenCV backend to use, or "any"
    pixel_format : what one image holds; mono8 and the Bayer mosaics come through bit for bit, (height, width)
    width, height, fps : requested, px and 1/s, and refused where the camera stays at others; None takes any. For an
        image sequence, which tells no times, ``fps`` states the rate at which it was taken
    embedded_info : the items that FRAME_INFO switches on in the camera, see :mod:`.embedded_info`
    buffer_frames : images kept between two reads; then a live source loses its oldest, a file waits
    open_timeout_s : longest wait for the first image of a stream
    read_timeout_s : longest silence of a stream before it counts as ended
    """

    source: str
    backend: Backend = "any"
    pixel_format: PixelFormat = "mono8"
    width: int | None = None
    height: int | None = None
    fps: float | None = None
    embedded_info: tuple[EmbeddedItem, ...] = ()
    buffer_frames: int = 16
    open_timeout_s: float = 5.0
    read_timeout_s: float = 2.0

    @property
    def is_device(self) -> bool:
        """Whether ``source`` is a device index."""
        return self.source.isdecimal()

    @property
    def is_url(self) -> bool:
        """Whether ``source`` is a network stream."""
        return "://" in self.source

    @property
    def is_file(self) -> bool:
        """Whether ``source`` is a video file or an image sequence, which waits for its reader."""
        return not (self.is_device or self.is_url)

    @property
    def is_sequence(self) -> bool:
        """Whether ``source`` is an image sequence."""
        return self.is_file and "%" in self.source

    def __post_init__(self) -> None:
        if self.pixel_format not in PIXEL_FORMATS:
            raise ConfigurationError(
                f"pixel_format {self.pixel_format!r}: use one of {', '.join(PIXEL_FORMATS)}"
            )
        if self.backend not in get_args(Backend):
            raise ConfigurationError(f"backend {self.backend!r}: use one of {', '.join(get_args(Backend))}")
        unknown = set(self.embedded_info) - set(ITEMS)
        if unknown or len(set(self.embedded_info)) < len(self.embedded_info):
            raise ConfigurationError(
                f"embedded_info {list(self.embedded_info)}: name each item once, out of {', '.join(ITEMS)}"
            )
        if self.embedded_info and self.pixel_format == "bgr8":
            raise ConfigurationError(
                "embedded_info needs raw pixels: use mono8 or a Bayer pixel_format, not bgr8"
            )
        if self.buffer_frames < 1 or self.open_timeout_s <= 0 or self.read_timeout_s <= 0:
            raise ConfigurationError("buffer_frames, open_timeout_s and read_timeout_s must be positive")


def open_capture(settings: OpenCVCameraSettings) -> cv2.VideoCapture:
    """Open a source.

    Raises
    ------
    ConfigurationError
        OpenCV was built without the backend.
    DeviceUnreachableError
        The source cannot be opened.
    """
    backend = getattr(cv2, f"CAP_{settings.backend.upper()}")
    if backend != cv2.CAP_ANY and not cv2.videoio_registry.hasBackend(backend):
        raise ConfigurationError(f"camera {settings.source}: {_missing_backend(settings.backend)}")
    if settings.is_file:
        _refuse_pipes(Path(settings.source))
    if settings.is_device:
        capture = cv2.VideoCapture(int(settings.source), backend)
    elif settings.is_url:
        timeouts = [
            *(cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, round(1000 * settings.open_timeout_s)),
            *(cv2.CAP_PROP_READ_TIMEOUT_MSEC, round(1000 * settings.read_timeout_s)),
        ]
        capture = cv2.VideoCapture(settings.source, backend, timeouts)
    else:
        capture = cv2.VideoCapture(settings.source, backend)
    if not capture.isOpened():
        capture.release()
        raise DeviceUnreachableError(
            f"camera {settings.source}: OpenCV cannot open it; check that it exists, is plugged in and not "
            "in use (v4l2-ctl --list-devices lists indices; a FireWire camera needs the firewire backend)"
        )
    return capture


def _refuse_pipes(source: Path) -> None:
    """Refuse a pipe in the place of a film or of an image of a series: opening it would wait for ever."""
    name = re.compile(".*".join(map(re.escape, re.split(r"%\d*d", source.name))))
    beside = source.parent.iterdir() if source.parent.is_dir() else ()
    for place in beside:
        if name.fullmatch(place.name) and place.is_fifo():
            raise DeviceUnreachableError(f"camera {source}: {place.name} is a pipe; put a file there")


def _missing_backend(name: str) -> str:
    return (
        f"OpenCV {cv2.__version__} was built without the {name} backend. pip wheels never hold firewire or "
        "aravis: for a FireWire camera use the driver dc1394, or Debian's python3-opencv in a virtual "
        "environment made with --system-site-packages"
    )


def request_format(capture: cv2.VideoCapture, settings: OpenCVCameraSettings) -> None:
    """Ask for raw pixels, size and frame rate, and verify what the camera then states; raises ConfigurationError."""
    if settings.pixel_format != "bgr8":
        capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
    requests = (
        ("width", cv2.CAP_PROP_FRAME_WIDTH, settings.width, 0.0),
        ("height", cv2.CAP_PROP_FRAME_HEIGHT, settings.height, 0.0),
        ("fps", cv2.CAP_PROP_FPS, None if settings.is_sequence else settings.fps, _FPS_TOLERANCE),
    )
    for _, property_id, wanted, _ in requests:
        if wanted is not None:
            capture.set(property_id, wanted)
    for name, property_id, wanted, tolerance in requests:
        stated = capture.get(property_id)
        if wanted is not None and abs(stated - wanted) > tolerance * wanted:
            raise ConfigurationError(
                f"camera {settings.source}: {name} {wanted:g} was requested, but the camera stays at "
                f"{stated:g}; request what it offers"
            )


def check_coding(capture: cv2.VideoCapture, image: NDArray[np.uint8], settings: OpenCVCameraSettings) -> None:
    """Refuse planes of a colour coding that OpenCV passes as if they were grey levels; raises ConfigurationError."""
    stated = (capture.get(cv2.CAP_PROP_FRAME_HEIGHT), capture.get(cv2.CAP_PROP_FRAME_WIDTH))
    grey = True
    if settings.pixel_format != "bgr8" and capture.getBackendName() == "FFMPEG":
        code = int(capture.get(cv2.CAP_PROP_CODEC_PIXEL_FORMAT))
        grey = code.to_bytes(4, "little", signed=True) in _GREY_CODES
    if not grey or image.shape[:2] != stated:
        raise ConfigurationError(
            f"camera {settings.source}: its pixels are coded as colours or in blocks, not as grey levels, so "
            f"{settings.pixel_format} would not be what the camera saw; use pixel_format bgr8 or a lossless "
            "grey coding"
        )


def identity_of(
    capture: cv2.VideoCapture, settings: OpenCVCameraSettings, image: NDArray[np.uint8]
) -> DeviceIdentity:
    """Return what is known of an open source, after its first image."""
    height, width = image.shape[:2]
    details = {
        "width": str(width),
        "height": str(height),
        "fps": f"{capture.get(cv2.CAP_PROP_FPS):g}",
        "pixel_format": settings.pixel_format,
    }
    return DeviceIdentity("camera", f"OpenCV {capture.getBackendName()}", "", settings.source, details)
