"""Cameras that OpenCV can open: a device index, a video file, an image sequence or a network stream."""

import os
import re
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from robot_drivers.cameras.embedded_info import ITEMS, EmbeddedItem
from robot_drivers.cameras.frame_buffer import FrameBuffer
from robot_drivers.cameras.pixel_formats import PIXEL_FORMATS, PixelFormat, as_pixel_format
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import (
    ConfigurationError,
    DeviceError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.protocols import DeviceIdentity, Frame, StreamStatistics

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


class OpenCVCamera:
    """A :class:`robot_drivers.protocols.Camera` through ``cv2.VideoCapture``.

    :meth:`connect` returns with the first image in the buffer; from then on a thread of its own grabs every
    image. The host stamp is taken when ``grab`` returns. In :meth:`statistics`, ``received`` counts the
    images that came, ``lost`` those that the camera's own counter proves missing and those that gave way in a
    full buffer. Images of a file are numbered from 0 and have the file's times.

    A stream that ends or falls silent makes :meth:`read` raise DeviceTimeoutError once the buffer is empty;
    :meth:`close` and :meth:`connect` start over.
    """

    def __init__(self, settings: OpenCVCameraSettings) -> None:
        self._settings = settings
        self._capture: cv2.VideoCapture | None = None
        self._identity: DeviceIdentity | None = None
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._buffer = self._empty_buffer()
        self._grabbed = 0

    @property
    def identity(self) -> DeviceIdentity:
        """Who is connected; raises DeviceError before :meth:`connect`."""
        if self._identity is None:
            raise DeviceError(f"camera {self._settings.source}: not connected; call connect() first")
        return self._identity

    def connect(self) -> None:
        """Open the source, check what it delivers, and start grabbing.

        Raises
        ------
        ConfigurationError
            The backend is missing, or size, frame rate or coding are not what was requested.
        DeviceProtocolError
            The first image has another pixel format, or holds no embedded information.
        DeviceUnreachableError
            The source cannot be opened.
        DeviceTimeoutError
            It was opened and delivers no image.
        """
        if self._capture is not None:
            raise DeviceError(f"camera {self._settings.source}: already connected; close it first")
        self._stopping.clear()
        self._buffer = self._empty_buffer()
        self._grabbed = 0
        capture = _open(self._settings)
        try:
            _request(capture, self._settings)
            first = self._take_image(capture)
            _check_coding(capture, first.image, self._settings)
        except BaseException:
            capture.release()
            raise
        self._identity = _identity(capture, self._settings, first.image)
        self._capture = capture
        self._thread = threading.Thread(
            target=self._run, args=(capture,), name=f"camera {self._settings.source}"
        )
        self._thread.start()

    def read(self, timeout_s: float) -> list[Frame]:
        """Return the images since the last call, oldest first; wait up to ``timeout_s`` for a first one.

        Raises
        ------
        DeviceTimeoutError
            The stream has ended or fell silent, and every image before that was read.
        """
        return self._buffer.read(timeout_s)

    def statistics(self) -> StreamStatistics:
        """Return the counts since :meth:`connect`."""
        return self._buffer.statistics

    def close(self) -> None:
        """Stop grabbing and release the source; waits for a grab under way, at most ``read_timeout_s``."""
        self._stopping.set()
        self._buffer.release()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._capture is not None:
            self._capture.release()
            self._capture = None
        self._identity = None

    def _empty_buffer(self) -> FrameBuffer:
        settings = self._settings
        return FrameBuffer(settings.buffer_frames, settings.pixel_format, settings.embedded_info)

    def _run(self, capture: cv2.VideoCapture) -> None:
        while not self._stopping.is_set():
            try:
                self._take_image(capture)
            except DeviceProtocolError:
                self._buffer.reject()
            except DeviceError as error:
                self._buffer.fail(error)
                return

    def _take_image(self, capture: cv2.VideoCapture) -> Frame:
        settings = self._settings
        if settings.is_file:
            self._buffer.wait_for_room()
        if not capture.grab():
            raise DeviceTimeoutError(f"camera {settings.source}: {self._silence()}")
        stamp_ns, number = host_time_ns(), self._grabbed
        self._grabbed += 1
        retrieved, image = capture.retrieve()
        if not retrieved:
            raise DeviceProtocolError(f"camera {settings.source}: an image cannot be decoded")
        pixels = as_pixel_format(image, settings.pixel_format, settings.source)
        if settings.embedded_info or not settings.is_file:
            return self._buffer.add_raw(pixels, stamp_ns)
        return self._buffer.add(pixels, stamp_ns, number, self._time_in_file(capture, number))

    def _silence(self) -> str:
        """Return why no image comes, and what to do."""
        if self._settings.is_file:
            return f"it has ended after {self._grabbed} images, or the next one cannot be decoded; look at the file"
        return (
            f"the stream has ended, or was silent for {self._settings.read_timeout_s:g} s; check cable and power, "
            "then close and connect again"
        )

    def _time_in_file(self, capture: cv2.VideoCapture, number: int) -> float | None:
        """Return the time, s, of an image from the beginning of its file; None where nothing tells it."""
        if not self._settings.is_sequence:
            return float(capture.get(cv2.CAP_PROP_POS_MSEC)) * 1e-3
        return None if self._settings.fps is None else number / self._settings.fps


def _open(settings: OpenCVCameraSettings) -> cv2.VideoCapture:
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


def _request(capture: cv2.VideoCapture, settings: OpenCVCameraSettings) -> None:
    """Ask for raw pixels, size and frame rate, and verify what the camera then states."""
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


def _check_coding(
    capture: cv2.VideoCapture, image: NDArray[np.uint8], settings: OpenCVCameraSettings
) -> None:
    """Refuse planes of a colour coding that OpenCV passes as if they were grey levels."""
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


def _identity(
    capture: cv2.VideoCapture, settings: OpenCVCameraSettings, image: NDArray[np.uint8]
) -> DeviceIdentity:
    height, width = image.shape[:2]
    details = {
        "width": str(width),
        "height": str(height),
        "fps": f"{capture.get(cv2.CAP_PROP_FPS):g}",
        "pixel_format": settings.pixel_format,
    }
    return DeviceIdentity("camera", f"OpenCV {capture.getBackendName()}", "", settings.source, details)
