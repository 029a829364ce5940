"""Orders to a thread that runs a cycle: others give them, and it carries them out between two of its turns."""

import queue
import socket
import threading
from collections.abc import Callable

from robot_drivers.errors import DeviceTimeoutError

_TIMEOUT_S = 5.0


class Orders:
    """What other threads want done."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._bell, self._wake = socket.socketpair()

    @property
    def waiting_on(self) -> socket.socket:
        """What becomes readable when an order waits."""
        return self._bell

    def give(self, order: Callable[[], None]) -> None:
        """Hand an order over and wait until it has been carried out.

        Raises
        ------
        DeviceTimeoutError
            When nobody carries it out.
        """
        done = threading.Event()

        def carry_out_and_tell() -> None:
            order()
            done.set()

        self._waiting.put(carry_out_and_tell)
        self._wake.send(b"!")
        if not done.wait(_TIMEOUT_S):
            raise DeviceTimeoutError("the emulated controller does not react; its thread has ended or hangs")

    def carry_out(self) -> None:
        """Carry out all that wait."""
        while not self._waiting.empty():
            self._bell.recv(1)
            self._waiting.get()()

    def close(self) -> None:
        """Release the sockets."""
        self._bell.close()
        self._wake.close()
