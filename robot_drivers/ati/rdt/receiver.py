"""Receives the datagrams of one device in bulk, stamped by the kernel; those of others are rejected."""

import selectors
import socket
import time
from dataclasses import dataclass

import numpy as np

from robot_drivers.clock import (
    host_time_ns,
    host_times_ns,
    monotonic_time_ns,
    wall_to_monotonic_offset_ns,
)
from robot_drivers.interfaces import address_towards
from robot_drivers.kernel_stamps import KERNEL_STAMPS, STAMP_SPACE, request_stamps, wall_time_ns
from robot_drivers.protocols import IntArray

_WANTED_BUFFER_BYTES = 4 * 1024 * 1024
_MAX_DATAGRAMS_PER_BATCH = 16384
_LARGEST_DATAGRAM = 65536
_BUFFER_BYTES = 1024 * 1024
_CLOCK_STEP_NS = 1_000_000


@dataclass(frozen=True, slots=True)
class Datagrams:
    """Datagrams in order of arrival.

    Attributes
    ----------
    payload : their bytes laid end to end; valid until the next call of the receiver
    sizes : (n,) int64, bytes of each
    host_time_ns : (n,) int64, receive stamps on the host clock
    """

    payload: memoryview
    sizes: IntArray
    host_time_ns: IntArray


@dataclass(frozen=True, slots=True)
class LinkStatistics:
    """What the network did since the stream started.

    Attributes
    ----------
    foreign_datagrams : rejected because they came from someone else
    repeated_starts : start requests sent again because of silence
    local_port : UDP port that the records arrive at, which a firewall must let through
    receive_buffer_bytes : what the system granted
    kernel_stamps : whether host times are the kernel's
    """

    foreign_datagrams: int
    repeated_starts: int
    local_port: int
    receive_buffer_bytes: int
    kernel_stamps: bool


class DatagramReceiver:
    """A UDP socket that hears one peer, on the network interface that leads to it.

    Parameters
    ----------
    peer : IPv4 address and port of the device
    accepted_sizes : lengths a datagram may have, bytes
    batch_s : shortest time between two batches. The kernel holds and stamps what arrives meanwhile, so this
        saves work without cost in accuracy; it does not apply where the kernel gives no stamps
    kernel_stamps : whether to ask the kernel for receive stamps

    Attributes
    ----------
    foreign : datagrams that came from someone else; they were rejected
    malformed : datagrams of another length; they were rejected

    Raises
    ------
    OSError
        No network leads to the peer.
    """

    def __init__(
        self,
        peer: tuple[str, int],
        accepted_sizes: frozenset[int],
        batch_s: float,
        kernel_stamps: bool = KERNEL_STAMPS,
    ) -> None:
        self.foreign = 0
        self.malformed = 0
        self.kernel_stamps = kernel_stamps
        self._peer = peer
        self._accepted_sizes = accepted_sizes
        self._buffer = memoryview(bytearray(_BUFFER_BYTES))
        self._batch_ns = round(batch_s * 1e9) if kernel_stamps else 0
        self._next_batch_ns = 0
        self._offset_ns, self._offset_at_ns = wall_to_monotonic_offset_ns(), monotonic_time_ns()
        self._latest_ns = 0
        interface = address_towards(peer[0])
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind((interface, 0))
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _WANTED_BUFFER_BYTES)
        if kernel_stamps:
            request_stamps(self._socket)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._socket, selectors.EVENT_READ)

    @property
    def local_port(self) -> int:
        """The UDP port that datagrams arrive at."""
        return int(self._socket.getsockname()[1])

    @property
    def buffer_bytes(self) -> int:
        """The receive buffer that the system granted."""
        return self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)

    def close(self) -> None:
        """Release the socket."""
        self._selector.close()
        self._socket.close()

    def send(self, data: bytes) -> None:
        """Send one datagram to the peer.

        Raises
        ------
        OSError
            The network is not there.
        """
        self._socket.sendto(data, self._peer)

    def wait(self, timeout_s: float) -> bool:
        """Tell whether a datagram is there; wait up to ``timeout_s`` for one."""
        return bool(self._selector.select(max(0.0, timeout_s)))

    def receive(self, timeout_s: float) -> Datagrams:
        """Return all that has arrived; wait up to ``timeout_s`` for a first datagram."""
        deadline_ns = host_time_ns() + round(timeout_s * 1e9)
        time.sleep(max(0, min(deadline_ns, self._next_batch_ns) - host_time_ns()) * 1e-9)
        sizes: list[int] = []
        stamps: list[int] = []
        while self.wait((deadline_ns - host_time_ns()) * 1e-9):
            self._drain(sizes, stamps)
            if sizes or host_time_ns() >= deadline_ns:
                break
        self._next_batch_ns = host_time_ns() + self._batch_ns
        return Datagrams(
            self._buffer[: sum(sizes)],
            np.array(sizes, np.int64),
            self._on_host_clock(np.array(stamps, np.int64)),
        )

    def _drain(self, sizes: list[int], stamps: list[int]) -> None:
        """Take what the socket holds, up to one batch, so that no reader falls behind."""
        receive_one = self._receive_stamped if self.kernel_stamps else self._receive_plain
        filled = 0
        for _ in range(_MAX_DATAGRAMS_PER_BATCH):
            if filled > _BUFFER_BYTES - _LARGEST_DATAGRAM:
                break
            try:
                size, peer, stamp = receive_one(self._buffer[filled:])
            except (BlockingIOError, ConnectionResetError):  # the latter: Windows reports a closed port here
                break
            if peer != self._peer:
                self.foreign += 1
            elif size not in self._accepted_sizes:
                self.malformed += 1
            else:
                sizes.append(size)
                stamps.append(stamp)
                filled += size

    def _receive_stamped(self, slot: memoryview) -> tuple[int, object, int]:
        size, ancillary, _, peer = self._socket.recvmsg_into((slot,), STAMP_SPACE)
        return size, peer, wall_time_ns(ancillary)

    def _receive_plain(self, slot: memoryview) -> tuple[int, object, int]:
        size, peer = self._socket.recvfrom_into(slot)
        return size, peer, host_time_ns()

    def _on_host_clock(self, stamps: IntArray) -> IntArray:
        """Carry kernel stamps from the wall clock to the host clock."""
        if not self.kernel_stamps:
            return stamps
        now_ns = monotonic_time_ns()
        offset_ns = wall_to_monotonic_offset_ns()
        drift_ns = (now_ns - self._offset_at_ns) // 1000  # a wall clock is slewed by less than 1 ms/s
        stepped = abs(offset_ns - self._offset_ns) > _CLOCK_STEP_NS + drift_ns
        self._offset_ns, self._offset_at_ns = offset_ns, now_ns
        times_ns = host_times_ns(np.full_like(stamps, now_ns) if stepped else stamps + offset_ns)
        if len(times_ns) == 0:
            return times_ns
        # The kernel stamps in the order of arrival: what seems to go back is an error of the clocks, not of the order.
        times_ns = np.maximum.accumulate(np.maximum(times_ns, self._latest_ns))
        self._latest_ns = int(times_ns[-1])
        return times_ns
