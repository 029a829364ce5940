"""The bytes of RDT, the UDP stream of an ATI Net F/T box: requests to the box, records from it.

Everything is big-endian. Source: ATI 9620-05-Net FT, chapters on RDT and its request and record structures.
"""

import ipaddress
import struct
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from robot_drivers.errors import ConfigurationError, DeviceProtocolError
from robot_drivers.protocols import IntArray

HEADER = 0x1234
MAX_SAMPLE_COUNT = 0xFFFF_FFFF
MAX_RECORDS_PER_DATAGRAM = 40

RECORD = np.dtype([("rdt_sequence", ">u4"), ("ft_sequence", ">u4"), ("status", ">u4"), ("counts", ">i4", 6)])

DATAGRAM_SIZES = frozenset(RECORD.itemsize * n for n in range(1, MAX_RECORDS_PER_DATAGRAM + 1))
"""Lengths that a datagram of the box can have, bytes."""

_REQUEST = struct.Struct(">HHI")
_TO_ANOTHER = 0x8000
_DESTINATION = struct.Struct(">4BH")


class Command(IntEnum):
    """Command codes of an RDT request. None is acknowledged; the latest one takes precedence."""

    STOP = 0x0000
    START_REAL_TIME = 0x0002
    START_BUFFERED = 0x0003
    RESET_LATCH = 0x0041
    SET_BIAS = 0x0042


@dataclass(frozen=True, slots=True)
class Records:
    """Decoded RDT records, oldest first.

    Attributes
    ----------
    rdt_sequence : (n,) uint32, position in the output stream, 1 for the first record after a start
    ft_sequence : (n,) uint32, internal samples since power-up
    status : (n,) int64, the status word
    counts : (n, 6) int32, Fx Fy Fz Tx Ty Tz in counts
    """

    rdt_sequence: NDArray[np.uint32]
    ft_sequence: NDArray[np.uint32]
    status: IntArray
    counts: NDArray[np.int32]


def request(command: Command, sample_count: int = 0) -> bytes:
    """Encode a request; ``sample_count`` is the number of records wanted, 0 means until stopped.

    Raises
    ------
    ConfigurationError
        ``sample_count`` does not fit 32 bits, or is given for buffered streaming, where the manuals disagree
        whether it counts records or datagrams.
    """
    if not 0 <= sample_count <= MAX_SAMPLE_COUNT:
        raise ConfigurationError(f"RDT sample count {sample_count}: must be 0..{MAX_SAMPLE_COUNT}")
    if sample_count and command is Command.START_BUFFERED:
        raise ConfigurationError(
            f"RDT sample count {sample_count} in buffered mode: its unit is not defined; use 0 and stop"
        )
    return _REQUEST.pack(HEADER, command, sample_count)


def request_for(command: Command, destination: tuple[str, int]) -> bytes:
    """Encode a request whose records go to another IPv4 address and UDP port, such as those of a multicast group.

    Raises
    ------
    ConfigurationError
        The address is no IPv4 address, or the port is none.
    """
    address, port = destination
    try:
        where = _DESTINATION.pack(*ipaddress.IPv4Address(address).packed, port)
    except (ValueError, struct.error) as error:
        raise ConfigurationError(f"RDT destination {address!r} port {port}: {error}") from error
    return _REQUEST.pack(HEADER, command | _TO_ANOTHER, 0) + where


def decode(payload: bytes | bytearray | memoryview) -> Records:
    """Decode the records of one datagram, or of several laid end to end.

    Raises
    ------
    DeviceProtocolError
        The payload is not a whole number of records.
    """
    if len(payload) % RECORD.itemsize:
        raise DeviceProtocolError(
            f"RDT payload of {len(payload)} bytes: must be a multiple of {RECORD.itemsize}"
        )
    records = np.frombuffer(payload, RECORD)
    return Records(
        records["rdt_sequence"].astype(np.uint32),
        records["ft_sequence"].astype(np.uint32),
        records["status"].astype(np.int64),
        records["counts"].astype(np.int32),
    )
