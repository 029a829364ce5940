"""What every camera driver does alike: a thread takes each image into a buffer, which is read from another."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Generic, TypeVar

from robot_drivers.cameras.frame_buffer import FrameBuffer
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import DeviceIdentity, Frame, StreamStatistics

Source = TypeVar("Source")


class StreamedCamera(ABC, Generic[Source]):
    """A :class:`robot_drivers.protocols.Camera`, whatever its images come from.

    :meth:`connect` returns with the first image in the buffer. A stream that ends or falls silent makes :meth:`read`
    raise once the buffer is empty; :meth:`close` and :meth:`connect` start over.

    Parameters
    ----------
    name : of the camera, in messages
    new_buffer : makes the buffer of one connection
    """

    def __init__(self, name: str, new_buffer: Callable[[], FrameBuffer]) -> None:
        self._name = name
        self._new_buffer = new_buffer
        self._buffer = new_buffer()
        self._source: Source | None = None
        self._identity: DeviceIdentity | None = None
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()

    @property
    def identity(self) -> DeviceIdentity:
        """Who is connected; raises DeviceError before :meth:`connect`."""
        if self._identity is None:
            raise self._not_connected()
        return self._identity

    def connect(self) -> None:
        """Open the camera, check what it delivers, and start taking its images.

        Raises
        ------
        ConfigurationError
            What opens it is missing, or it is not, and cannot be, set as wanted.
        DeviceUnreachableError
            There is no such camera.
        DeviceTimeoutError
            It was opened and delivers no image.
        DeviceProtocolError
            Its images are not what they should be.
        DeviceFaultError
            What opens it reports an error.
        """
        if self._source is not None:
            raise DeviceError(f"{self._name}: already connected; close it first")
        self._stopping.clear()
        self._buffer = self._new_buffer()
        source = self._open()
        try:
            identity = self._begin(source)
        except BaseException:
            self._release(source)
            raise
        self._source, self._identity = source, identity
        self._thread = threading.Thread(target=self._run, args=(source,), name=self._name)
        self._thread.start()

    def read(self, timeout_s: float) -> list[Frame]:
        """Return the images since the last call, oldest first; wait up to ``timeout_s`` for a first one.

        Raises
        ------
        DeviceTimeoutError, DeviceFaultError
            The stream has ended, fell silent or failed, and every image before that was read.
        """
        return self._buffer.read(timeout_s)

    def statistics(self) -> StreamStatistics:
        """Return the counts since :meth:`connect`."""
        return self._buffer.statistics

    def close(self) -> None:
        """Stop taking images and release the camera; waits for an image that is just being taken."""
        self._stopping.set()
        self._buffer.release()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._source is not None:
            self._release(self._source)
            self._source = None
        self._identity = None

    def _connected(self) -> Source:
        if self._source is None:
            raise self._not_connected()
        return self._source

    def _not_connected(self) -> DeviceError:
        return DeviceError(f"{self._name}: not connected; call connect() first")

    @abstractmethod
    def _open(self) -> Source:
        """Open what the images come from."""

    @abstractmethod
    def _begin(self, source: Source) -> DeviceIdentity:
        """Take the first image and check it; return who the camera is."""

    @abstractmethod
    def _run(self, source: Source) -> None:
        """Take images until the camera is closed, or fail the buffer."""

    @abstractmethod
    def _release(self, source: Source) -> None:
        """Close what was opened."""
