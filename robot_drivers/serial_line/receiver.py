"""Empties a serial line from a thread of its own, so that nothing overflows and every byte has a time of arrival."""

import threading
import time
from collections import deque
from dataclasses import dataclass

from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceUnreachableError
from robot_drivers.serial_line.line import SerialLine


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes that were there together, and when they were found, on the host clock, ns."""

    data: bytes
    host_time_ns: int


class SerialReceiver:
    """Reads a line from construction until :meth:`stop`.

    Parameters
    ----------
    line : nobody else may read it meanwhile
    batch_s : time between two looks at the line, by which stamps can be late
    """

    def __init__(self, line: SerialLine, batch_s: float) -> None:
        self._line = line
        self._batch_s = batch_s
        self._chunks: deque[Chunk] = deque()
        self._failure: DeviceUnreachableError | None = None
        self._last_ns = host_time_ns()
        self._news = threading.Condition()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._receive, name=f"serial receiver: {line.port}")
        self._thread.start()

    def wait(self, timeout_s: float) -> bool:
        """Tell whether something has arrived; wait up to ``timeout_s`` for it.

        Raises
        ------
        DeviceUnreachableError
            Nothing has arrived that was not taken, and nothing can come any more: the port has failed.
        """
        with self._news:
            self._news.wait_for(lambda: self._chunks or self._failure, timeout_s)
            if self._failure is not None and not self._chunks:
                raise DeviceUnreachableError(*self._failure.args) from self._failure
            return bool(self._chunks)

    def take(self, timeout_s: float) -> list[Chunk]:
        """Return what has arrived since the last call; wait up to ``timeout_s`` for it. Raises as ``wait``."""
        self.wait(timeout_s)
        with self._news:
            taken = list(self._chunks)
            self._chunks.clear()
            return taken

    def wait_until_silent(self, silence_s: float, limit_s: float) -> bool:
        """Tell whether the line has been silent for ``silence_s``; wait for it up to ``limit_s``."""
        begin_ns = host_time_ns()
        while (now_ns := host_time_ns()) - max(self._last_ns, begin_ns) < silence_s * 1e9:
            if now_ns - begin_ns > limit_s * 1e9:
                return False
            time.sleep(self._batch_s)
        return True

    def stop(self) -> None:
        """Stop reading; what has arrived can still be taken."""
        self._stopping.set()
        self._thread.join()

    def _receive(self) -> None:
        while not self._stopping.wait(self._batch_s):
            try:
                data = self._line.read()
            except DeviceUnreachableError as error:
                with self._news:
                    self._failure = error
                    self._news.notify_all()
                return
            if data:
                with self._news:
                    self._last_ns = host_time_ns()
                    self._chunks.append(Chunk(data, self._last_ns))
                    self._news.notify_all()
