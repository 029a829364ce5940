"""Receiving datagrams with the kernel's receive stamp."""

import select
import socket
from dataclasses import dataclass

import numpy as np

from robot_drivers.clock import host_times_ns, monotonic_time_ns, wall_to_monotonic_offset_ns
from robot_drivers.errors import ConfigurationError
from robot_drivers.kernel_stamps import KERNEL_STAMPS, STAMP_SPACE, request_stamps, wall_time_ns

_LARGEST_DATAGRAM = 65536
_MOST_AT_ONCE = 4096  # a sender faster than this loop must not keep it from returning
_RECEIVE_BUFFER = 1 << 20


@dataclass(frozen=True, slots=True)
class Datagram:
    """Bytes from the network, receive stamp on the host clock (ns), and the sender's (address, port)."""

    content: bytes
    host_time_ns: int
    sender: tuple[str, int]


class StampedSocket:
    """A bound UDP socket that never blocks longer than asked and stamps every datagram.

    Where the kernel stamps (Linux), it begins some milliseconds after the first socket of the system asked for it;
    until then, and elsewhere, the stamp is that of reading.
    """

    def __init__(self, bind_address: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
            if KERNEL_STAMPS:
                request_stamps(self._socket)
            self._socket.bind((bind_address, port))
        except OSError as error:
            self._socket.close()
            raise ConfigurationError(
                f"cannot listen on UDP {bind_address}:{port} ({error.strerror}); "
                "choose another port or end the program that holds it"
            ) from error

    @property
    def port(self) -> int:
        """The port it is bound to."""
        return int(self._socket.getsockname()[1])

    def receive(self, timeout_s: float) -> list[Datagram]:
        """Return everything that has arrived, waiting up to ``timeout_s`` for a first datagram."""
        readable, _, _ = select.select([self._socket], [], [], max(timeout_s, 0.0))
        if not readable:
            return []
        receive_one = self._receive_stamped if KERNEL_STAMPS else self._receive_plain
        wall_to_monotonic_ns = wall_to_monotonic_offset_ns()
        received: list[tuple[bytes, int, tuple[str, int]]] = []
        while len(received) < _MOST_AT_ONCE:
            try:
                received.append(receive_one(wall_to_monotonic_ns))
            except (BlockingIOError, ConnectionError):  # the latter: Windows, when nobody took an answer
                break
        stamps = host_times_ns(np.array([stamp for _, stamp, _ in received], np.int64)).tolist()
        return [
            Datagram(content, stamp, sender)
            for (content, _, sender), stamp in zip(received, stamps, strict=True)
        ]

    def send(self, content: bytes, receiver: tuple[str, int]) -> None:
        """Send one datagram."""
        self._socket.sendto(content, receiver)

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def _receive_stamped(self, wall_to_monotonic_ns: int) -> tuple[bytes, int, tuple[str, int]]:
        content, ancillary, _, sender = self._socket.recvmsg(_LARGEST_DATAGRAM, STAMP_SPACE)
        return content, wall_time_ns(ancillary) + wall_to_monotonic_ns, sender

    def _receive_plain(self, wall_to_monotonic_ns: int) -> tuple[bytes, int, tuple[str, int]]:
        content, sender = self._socket.recvfrom(_LARGEST_DATAGRAM)
        return content, monotonic_time_ns(), sender
