"""Images on their way to the file: a thread a camera compresses them, or passes them on raw when it falls behind."""

import queue
import threading
from collections.abc import Callable, Sequence

from daq.recording.messages import codec
from daq.recording.messages.codec import EncodedImage, Encoding
from robot_drivers.protocols import Frame

RAW_FROM_BACKLOG = 4
MOST_WAITING = 48


class ImageEncoder:
    """Encodes the images of one camera in the order of their arrival.

    Parameters
    ----------
    deliver : called in the encoder's thread with an encoded image, its place in the stream, and how many images
        waited behind it; from ``RAW_FROM_BACKLOG`` on they are passed on raw, unless the disk is what is slow
    drop : called with the number of images that found ``MOST_WAITING`` waiting, and were dropped
    disk_is_slow : tells whether raw images would make matters worse
    encoding : which images of the frames are encoded, and how
    """

    def __init__(
        self,
        name: str,
        deliver: Callable[[EncodedImage, int, int], None],
        drop: Callable[[int], None],
        disk_is_slow: Callable[[], bool],
        encoding: Encoding = codec.IMAGES,
    ) -> None:
        self._encoding = encoding
        self._deliver = deliver
        self._drop = drop
        self._disk_is_slow = disk_is_slow
        self._waiting: queue.Queue[Frame | None] = queue.Queue()
        self._thread = threading.Thread(target=self._encode, name=f"encode-{name}")
        self._thread.start()

    def put(self, frames: Sequence[Frame]) -> None:
        """Hand over images; never waits."""
        for frame in frames:
            if self._waiting.qsize() < MOST_WAITING:
                self._waiting.put(frame)
            else:
                self._drop(1)

    def close(self) -> None:
        """Encode what waits and end the thread."""
        self._waiting.put(None)
        self._thread.join()

    def is_alive(self) -> bool:
        """Tell whether the thread runs."""
        return self._thread.is_alive()

    def _encode(self) -> None:
        sequence = 0
        while (frame := self._waiting.get()) is not None:
            backlog = self._waiting.qsize()
            behind = backlog >= RAW_FROM_BACKLOG and not self._disk_is_slow()
            encode = self._encoding.raw if behind else self._encoding.compressed
            self._deliver(encode(frame), sequence, backlog)
            sequence += 1
