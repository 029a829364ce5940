"""The records that a stand-alone ATI F/T Controller streams over RS-232: ASCII or binary, of 16 or 24 bits.

Neither has a checksum. An ASCII record shows every lost or added byte by its fixed layout, and no changed digit. A
binary record shows a lost byte only where that moves a value beyond what the transducer can read; close to no load
it may not. So ASCII is the format to be preferred where its rate is enough. Sources: captures by open-source
drivers; the 24-bit forms follow from one of them each.
"""

import re

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.serial.framing import ByteArray, FrameSynchroniser, Records

_FIELD_WIDTHS = {16: 6, 24: 8}
_LARGEST_FLAG = 9
_CONTROLLER_TALK = re.compile(rb"[\s>\x06]*(QS)?[\s>\x06]*")
"""Prompt, acknowledgement and echo, which frame a stream."""


def ascii_counts(line: bytes, bits: int) -> tuple[int, ...] | None:
    """Return error digit and six counts of an ASCII record without its end of line; None where it is none.

    The layout is ``e,ffffff,ffffff,ffffff,tttttt,tttttt,tttttt`` with right-aligned fields of 6 (16 bits) or 8
    (24 bits) characters.
    """
    width = _FIELD_WIDTHS[bits]
    flag, *fields = line.split(b",")
    if len(flag) != 1 or not flag.isdigit() or len(fields) != 6:
        return None
    if not all(len(field) == width and re.fullmatch(rb" *-?\d+", field) for field in fields):
        return None
    counts = tuple(int(field) for field in fields)
    if not all(-(2 ** (bits - 1)) <= count < 2 ** (bits - 1) for count in counts):
        return None
    return int(flag), *counts


class AsciiDecoder:
    """Finds ASCII records."""

    def __init__(self, bits: int) -> None:
        self.record_size = 1 + 6 * (1 + _FIELD_WIDTHS[bits]) + 2
        self.damages = 0
        self._bits = bits
        self._rest = b""
        self._position = 0  # of the rest in the stream
        self._accounted_to = 0
        self._last_index = -1
        self._in_damage = False

    def feed(self, data: bytes) -> Records:
        """Take the next bytes; return the records that are complete."""
        *lines, self._rest = (self._rest + data).split(b"\r")
        found = []
        for line in lines:
            begin = self._position
            self._position += len(line) + 1
            record = ascii_counts(line.removeprefix(b"\n"), self._bits)
            if record is not None:
                self._last_index += 1 - (self._accounted_to - begin) // self.record_size
                self._accounted_to = self._position
                self._in_damage = False
                found.append((*record, self._last_index, self._position))
            elif _CONTROLLER_TALK.fullmatch(line):
                self._accounted_to = self._position
            else:
                self.damages += not self._in_damage
                self._in_damage = True
        columns = np.array(found, np.int64).reshape(-1, 9)
        return Records(
            status=columns[:, 0],
            values=columns[:, 1:7].astype(np.int32),
            index=columns[:, 7],
            end=columns[:, 8],
        )


def binary_record_size(bits: int) -> int:
    """Return the bytes of a binary record: an error flag and six counts."""
    return 1 + 6 * bits // 8


def binary_counts(records: ByteArray, bits: int) -> NDArray[np.int32]:
    """Return the counts (n, 6) of binary records (n, size): big-endian, two's complement."""
    n, width = len(records), bits // 8
    widened = np.zeros((n, 6, 4), np.uint8)
    widened[:, :, :width] = records[:, 1:].reshape(n, 6, width)
    return widened.view(">i4")[:, :, 0].astype(np.int32) >> 32 - bits


class BinaryDecoder:
    """Finds binary records.

    Parameters
    ----------
    bits : 16 or 24
    largest_counts : (6,) counts beyond which no record can be
    """

    def __init__(self, bits: int, largest_counts: NDArray[np.float64]) -> None:
        self.record_size = binary_record_size(bits)
        self._bits = bits
        self._largest_counts = largest_counts
        self._frames = FrameSynchroniser(self.record_size, self._plausible)
        self._line_end_size = 0
        self._opened = False

    @property
    def damages(self) -> int:
        """How often the sequence of good records was interrupted."""
        return self._frames.damages

    def feed(self, data: bytes) -> Records:
        """Take the next bytes; return the records that have become certain."""
        if not self._opened:  # whether the echo of the command ends in CR LF is not documented
            records = data.lstrip(b"\r\n")
            self._line_end_size += len(data) - len(records)
            self._opened = bool(records)
            data = records
        frames = self._frames.feed(data)
        return Records(
            status=frames.content[:, 0].astype(np.int64),
            values=binary_counts(frames.content, self._bits),
            index=frames.index,
            end=frames.end + self._line_end_size,
        )

    def _plausible(self, records: ByteArray) -> NDArray[np.bool_]:
        counts = binary_counts(records, self._bits)
        return (records[:, 0] <= _LARGEST_FLAG) & (np.abs(counts) <= self._largest_counts).all(axis=1)
