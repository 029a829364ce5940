"""Cameras that OpenCV can open: a device index, a video file, an image sequence or a network stream."""

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
from robot_drivers.cameras.streamed_camera import StreamedCamera
from robot_drivers.clock import host_time_ns
from robot_drivers.driver import Driver
from robot_drivers.errors import DeviceError, DeviceProtocolError, DeviceTimeoutError
from robot_drivers.protocols import DeviceIdentity, Frame
from robot_drivers.specification import CameraSpecification


class OpenCVCamera(StreamedCamera[cv2.VideoCapture]):
    """A camera through ``cv2.VideoCapture``.

    The host stamp is taken when ``grab`` returns. In :meth:`statistics`, ``received`` counts the images that came,
    ``lost`` those that the camera's own counter proves missing and those that gave way in a full buffer. Images of a
    file are numbered from 0 and have the file's times. :meth:`close` waits for a grab under way, at most
    ``read_timeout_s``.
    """

    def __init__(self, settings: OpenCVCameraSettings) -> None:
        super().__init__(
            f"camera {settings.source}",
            lambda: FrameBuffer(settings.buffer_frames, settings.pixel_format, settings.embedded_info),
        )
        self._settings = settings
        self._grabbed = 0

    def _open(self) -> cv2.VideoCapture:
        self._grabbed = 0
        return open_capture(self._settings)

    def _begin(self, source: cv2.VideoCapture) -> DeviceIdentity:
        request_format(source, self._settings)
        first = self._take_image(source)
        check_coding(source, first.image, self._settings)
        return identity_of(source, self._settings, first.image)

    def _release(self, source: cv2.VideoCapture) -> None:
        source.release()

    def _run(self, source: cv2.VideoCapture) -> None:
        while not self._stopping.is_set():
            try:
                self._take_image(source)
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
