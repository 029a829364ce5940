"""Cameras that OpenCV can open: a device index, a video file, an image sequence or a network stream."""

import threading
from urllib.parse import urlsplit

import cv2

from robot_drivers.cameras.frame_buffer import FrameBuffer
from robot_drivers.cameras.opencv_capture import (
    OpenCVCameraSettings,
    check_coding,
    identity_of,
    open_capture,
    request_format,
)
from robot_drivers.cameras.pixel_formats import as_pixel_format
from robot_drivers.clock import host_time_ns
from robot_drivers.driver import Driver
from robot_drivers.errors import DeviceError, DeviceProtocolError, DeviceTimeoutError
from robot_drivers.protocols import DeviceIdentity, Frame, StreamStatistics
from robot_drivers.specification import CameraSpecification


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
        capture = open_capture(self._settings)
        try:
            request_format(capture, self._settings)
            first = self._take_image(capture)
            check_coding(capture, first.image, self._settings)
        except BaseException:
            capture.release()
            raise
        self._identity = identity_of(capture, self._settings, first.image)
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


def _specification(settings: OpenCVCameraSettings) -> CameraSpecification:
    return CameraSpecification(host=urlsplit(settings.source).hostname or "", frames_per_s=settings.fps)


DRIVER = Driver(OpenCVCameraSettings, OpenCVCamera, _specification)
