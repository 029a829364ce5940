"""Receive stamps of the kernel for UDP datagrams, where the system offers them: reading late then costs nothing."""

import socket
import struct
import sys
import time

KERNEL_STAMPS = sys.platform == "linux" and sys.maxsize > 2**32
"""Whether the system stamps datagrams on arrival (``SO_TIMESTAMPNS``)."""

STAMP_SPACE = 64
"""Bytes of ancillary data to make room for: a control message with one timespec."""

_SO_TIMESTAMPNS = 35  # asm-generic/socket.h; Python has no name for it
_TIMESPEC = struct.Struct("@ll")
_PROBES, _PROBE_WAIT_S = 500, 1e-3


def request_stamps(receiver: socket.socket) -> None:
    """Let the kernel stamp what arrives at a socket from now on.

    The kernel begins to stamp a moment after the first socket has asked for it, on a busy machine a long one, and until
    then says when a datagram was read. This returns once it stamps, or after about half a second where it does not.

    Raises
    ------
    OSError
        The machine has no loopback network.
    """
    receiver.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        probe.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        for _ in range(_PROBES):
            if _stamped_on_arrival(probe):
                return


def _stamped_on_arrival(probe: socket.socket) -> bool:
    """Tell whether a datagram that a socket has sent to itself is stamped before it is read."""
    probe.sendto(b"?", probe.getsockname())
    sent_ns = time.time_ns()
    time.sleep(_PROBE_WAIT_S)
    try:
        _, ancillary, _, _ = probe.recvmsg(1, STAMP_SPACE, socket.MSG_DONTWAIT)
    except BlockingIOError:
        return False  # nothing has come over the loopback yet
    return wall_time_ns(ancillary) <= sent_ns


def wall_time_ns(ancillary: list[tuple[int, int, bytes]]) -> int:
    """Return the stamp, on the wall clock, in what ``recvmsg`` gave beside the datagram."""
    seconds, nanoseconds = _TIMESPEC.unpack(ancillary[0][2])
    return int(seconds) * 1_000_000_000 + int(nanoseconds)
