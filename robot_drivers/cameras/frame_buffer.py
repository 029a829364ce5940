"""Images between the thread that receives them and the one that reads them, with what the camera embedded in them."""

import threading
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robot_drivers.cameras.embedded_info import (
    EmbeddedItem,
    FrameSequence,
    blank_frame_info,
    read_frame_info,
)
from robot_drivers.cameras.pixel_formats import PixelFormat
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import DepthImage, Frame, StreamStatistics


class FrameBuffer:
    """The images of one stream, a limited number of them at a time.

    Parameters
    ----------
    capacity : images kept between two reads
    pixel_format : of all images
    embedded_info : the items that FRAME_INFO switches on in the camera; their pixels are blanked
    """

    def __init__(
        self, capacity: int, pixel_format: PixelFormat, embedded_info: Sequence[EmbeddedItem]
    ) -> None:
        self._capacity = capacity
        self._pixel_format = pixel_format
        self._items = tuple(embedded_info)
        self._changed = threading.Condition()
        self._frames: deque[Frame] = deque()
        self._sequence = FrameSequence()
        self._received = self._overrun = self._malformed = self._missed = 0
        self._failure: DeviceError | None = None
        self._released = False

    def add_raw(self, pixels: NDArray[np.uint8], host_time_ns: int) -> Frame:
        """Keep an image of a camera, with the counter and the time that its pixels hold.

        Raises
        ------
        DeviceProtocolError
            The pixels do not hold them; the image is not kept.
        """
        if not self._items:
            return self.add(pixels, host_time_ns, None, None)
        info = read_frame_info(pixels, self._items)
        blank_frame_info(pixels, self._items)
        with self._changed:
            counter, device_time_s = self._sequence.unwrap(info, host_time_ns)
        return self.add(pixels, host_time_ns, counter, device_time_s)

    def add(
        self,
        pixels: NDArray[np.uint8],
        host_time_ns: int,
        counter: int | None,
        device_time_s: float | None,
        depth: DepthImage | None = None,
    ) -> Frame:
        """Keep an image, in place of the oldest where there is no room: that one counts as lost."""
        frame = Frame(counter, device_time_s, host_time_ns, self._pixel_format, pixels, depth)
        with self._changed:
            self._received += 1
            if not self._has_room():
                self._frames.popleft()
                self._overrun += 1
            self._frames.append(frame)
            self._changed.notify_all()
        return frame

    def wait_for_room(self) -> None:
        """Wait until nothing would be lost, or :meth:`release` was called."""
        with self._changed:
            self._changed.wait_for(lambda: self._has_room() or self._released)

    def reject(self) -> None:
        """Count an image that could not be used."""
        with self._changed:
            self._malformed += 1

    def miss(self, images: int) -> None:
        """Count images that the camera's numbers prove missing."""
        with self._changed:
            self._missed += images

    def fail(self, error: DeviceError) -> None:
        """End the stream; the error is raised once everything before it was read."""
        with self._changed:
            self._failure = error
            self._changed.notify_all()

    def release(self) -> None:
        """Let nobody wait for room any longer."""
        with self._changed:
            self._released = True
            self._changed.notify_all()

    def read(self, timeout_s: float) -> list[Frame]:
        """Return the images since the last call, oldest first; wait up to ``timeout_s`` for a first one.

        Raises
        ------
        DeviceError
            The stream has ended, and every image before that was read.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._frames or self._failure is not None, timeout_s)
            frames = list(self._frames)
            self._frames.clear()
            self._changed.notify_all()
            if not frames and self._failure is not None:
                raise self._failure
            return frames

    @property
    def statistics(self) -> StreamStatistics:
        """Counts so far; ``lost`` are images that the camera's counter proves missing, and those that gave way."""
        with self._changed:
            return StreamStatistics(
                received=self._received,
                lost=self._sequence.lost + self._missed + self._overrun,
                duplicated=self._sequence.duplicated,
                restarts=self._sequence.restarts,
                malformed=self._malformed,
            )

    def _has_room(self) -> bool:
        return len(self._frames) < self._capacity
