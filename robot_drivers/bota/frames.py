"""The frames that a Bota Systems force/torque sensor streams on its serial line in binary format.

37 bytes, little-endian: 0xAA, status (16 bits), six floats in N and N·m, a time in microseconds (32 bits), a
temperature in °C (float), and the CRC-16/X-25 of all that is between the first byte and itself. Source: Bota Systems'
serial driver and its Python example, as programs of others carry them on.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.transducer.status import StatusMap
from robot_drivers.protocols import FloatArray, IntArray

HEADER = 0xAA
FRAME = np.dtype(
    {
        "names": ["header", "status", "wrench", "time_us", "temperature_c", "crc"],
        "formats": ["u1", "<u2", ("<f4", 6), "<u4", "<f4", "<u2"],
        "offsets": [0, 1, 3, 27, 31, 35],
        "itemsize": 37,
    }
)

STATUS_MAP = StatusMap(
    "Bota serial",
    {
        0: "the sensor took too long",
        1: "force or torque out of range",
        2: "measurements invalid",
        3: "raw measurements, without the calibration",
    },
    usable_words=(0,),
)

_CHECKED = slice(1, 35)
_LONGEST_STEP_US = 1_000_000  # from one frame to the next; the slowest sensor sends a hundred in that time
_LARGEST_STEP_C = 10.0
_POLYNOMIAL = 0x8408  # 0x1021 with its bits reversed


def _table() -> NDArray[np.uint16]:
    values = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        values = np.where(values & 1, values >> 1 ^ _POLYNOMIAL, values >> 1).astype(np.uint16)
    return values


_TABLE = _table()


def crc16_x25(content: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return the CRC-16/X-25 of byte strings (n, size), (n,)."""
    register = np.full(len(content), 0xFFFF, np.uint16)
    for column in content.T:
        register = register >> 8 ^ _TABLE[(register ^ column) & 0xFF]
    return register ^ np.uint16(0xFFFF)


def holds(frames: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Tell for byte strings (n, 37) which of them are frames, (n,)."""
    found = frames[:, 0] == HEADER
    if found.any():
        of_header = np.flatnonzero(found)
        told = np.ascontiguousarray(frames[of_header, 35:]).view("<u2")[:, 0]
        found[of_header] = crc16_x25(frames[of_header, _CHECKED]) == told
    return found


def follows(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Tell for frames (n, 37) whether each of ``after`` can be the next one of a sensor that sent ``before``, (n,).

    Its clock has gone on by less than a second, its temperature is about the same. A misplaced stretch whose CRC
    fits by chance has other bytes in these places: its clock passes one time in 4000.
    """
    first, second = (np.ascontiguousarray(one).view(FRAME)[:, 0] for one in (before, after))
    step_us = (second["time_us"].astype(np.int64) - first["time_us"]) % 2**32
    warmth = first["temperature_c"]
    with np.errstate(invalid="ignore", over="ignore"):  # what is misplaced may be any number, or none
        warmer = np.abs(second["temperature_c"] - warmth)
    return (step_us > 0) & (step_us < _LONGEST_STEP_US) & ((warmer < _LARGEST_STEP_C) | ~np.isfinite(warmth))


@dataclass(frozen=True, slots=True)
class Frames:
    """Frames in order of arrival.

    Attributes
    ----------
    status : (n,) int64
    wrench : (n, 6) float64, N and N·m
    time_us : (n,) int64, the sensor's clock, which begins anew after 2**32
    temperature_c : (n,) float64
    end : (n,) int64, position in the stream of the byte after the frame
    """

    status: IntArray
    wrench: FloatArray
    time_us: IntArray
    temperature_c: FloatArray
    end: IntArray


class FrameDecoder:
    """Cuts a byte stream into frames; it may begin anywhere.

    Of 65536 stretches that are misplaced one has a CRC that fits, and every lost byte misplaces one. So a frame also
    has to follow another, in the stream, by its clock and by its temperature. In lock it follows the last one, and is
    taken as soon as it is there. Where none follows, the stream is searched for two of which one follows the other,
    from within the last frame on: that ends within the next one where its lost last byte was like that one's header.

    Attributes
    ----------
    damages : how often a frame did not follow a frame
    """

    def __init__(self) -> None:
        self.damages = 0
        self._locked = False
        self._buffer = b""  # in lock, from the last frame on that is known to be one
        self._taken = 0  # whether that frame was taken, 0 or 1
        self._position = 0  # of the buffer's first byte in the stream

    def feed(self, data: bytes) -> Frames:
        """Take the next bytes; return the frames that are complete."""
        self._buffer += data
        found: list[NDArray[np.uint8]] = [np.empty((0, FRAME.itemsize), np.uint8)]
        ends: list[IntArray] = [np.empty(0, np.int64)]
        while self._locked or self._lock():
            content, end = self._take()
            found.append(content)
            ends.append(end)
            if self._locked:
                break
        frames = np.ascontiguousarray(np.concatenate(found)).view(FRAME)[:, 0]
        return Frames(
            status=frames["status"].astype(np.int64),
            wrench=frames["wrench"].astype(np.float64),
            time_us=frames["time_us"].astype(np.int64),
            temperature_c=frames["temperature_c"].astype(np.float64),
            end=np.concatenate(ends),
        )

    def _take(self) -> tuple[NDArray[np.uint8], IntArray]:
        """Return the frames that follow each other from here on, (n, 37), and where they end, (n,)."""
        size = FRAME.itemsize
        n = len(self._buffer) // size
        content = np.frombuffer(self._buffer, np.uint8, n * size).reshape(n, size)
        good = holds(content[1:]) & follows(content[:-1], content[1:])
        intact = n if good.all() else 1 + int(np.argmin(good))
        new = np.arange(self._taken, intact)
        ends = self._position + size * (new + 1)
        self._taken = 1
        self._forget((intact - 1) * size)
        if intact < n:
            self.damages += 1
            self._locked = False
            self._forget(1)
        return content[new], ends

    def _lock(self) -> bool:
        """Find two frames of which one follows the other; leave the buffer at them, or at the last place for them."""
        size = FRAME.itemsize
        places = len(self._buffer) - size + 1
        if places <= size:
            return False
        strings = np.lib.stride_tricks.sliding_window_view(np.frombuffer(self._buffer, np.uint8), size)
        good = holds(strings)
        pairs = np.flatnonzero(good[:-size] & good[size:])
        pairs = pairs[follows(strings[pairs], strings[pairs + size])]
        if len(pairs):
            self._locked, self._taken = True, 0
            self._forget(int(pairs[0]))
            return True
        self._forget(places - size)
        return False

    def _forget(self, n: int) -> None:
        self._buffer = self._buffer[n:]
        self._position += n
