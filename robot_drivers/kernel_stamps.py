"""Receive stamps of the kernel for UDP datagrams, where the system offers them: reading late then costs nothing."""

import socket
import struct
import sys

KERNEL_STAMPS = sys.platform == "linux" and sys.maxsize > 2**32
"""Whether the system stamps datagrams on arrival (``SO_TIMESTAMPNS``)."""

STAMP_SPACE = 64
"""Bytes of ancillary data to make room for: a control message with one timespec."""

_SO_TIMESTAMPNS = 35  # asm-generic/socket.h; Python has no name for it
_TIMESPEC = struct.Struct("@ll")


def request_stamps(receiver: socket.socket) -> None:
    """Let the kernel stamp what arrives at a socket from now on."""
    receiver.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)


def wall_time_ns(ancillary: list[tuple[int, int, bytes]]) -> int:
    """Return the stamp, on the wall clock, in what ``recvmsg`` gave beside the datagram."""
    seconds, nanoseconds = _TIMESPEC.unpack(ancillary[0][2])
    return int(seconds) * 1_000_000_000 + int(nanoseconds)
