"""Fuzz target: the frames of a Bota Systems sensor."""

import binascii
import struct
from random import Random

from robot_drivers.bota.frames import FrameDecoder
from robot_drivers.fuzzing.force_sensors.serial_ft import DamagedStream, damaged, on_boundaries
from robot_drivers.fuzzing.target import Target, WrongValueError, agree

_SIZE = 37
_CONTENT = struct.Struct("<H6fIf")
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def _crc(data: bytes) -> int:
    """CRC-16/X-25 by the standard library's CRC of unreversed bits, which is not how the driver goes about it."""
    unreversed = binascii.crc_hqx(data.translate(_REVERSED), 0xFFFF)
    return int(f"{unreversed:016b}"[::-1], 2) ^ 0xFFFF


def _stream(random: Random) -> DamagedStream:
    """Frames of a sensor at rest, whose bytes now and then are those of a header."""
    frames = bytearray()
    clock = random.randrange(2**32)
    for _ in range(random.randrange(1, 20)):
        values = [random.gauss(0.0, 0.1) for _ in range(6)]
        content = _CONTENT.pack(random.choice((0, 0, 2, 0xAAAA)), *values, clock, 31.5)
        frames += b"\xaa" + content + struct.pack("<H", _crc(content))
        clock = (clock + 1250) % 2**32
    return damaged(random, _SIZE, bytes(frames))


def _check(stream: DamagedStream) -> bool:
    """Each frame is what the bytes before its end say, and none is made of two."""
    decoder, last_end = FrameDecoder(), 0
    for chunk in stream.chunks():
        frames = decoder.feed(chunk)
        for row, end in enumerate(frames.end.tolist()):
            begin = end - _SIZE
            bytes_ = stream.arrived[begin:end]
            status, *values, clock, temperature = _CONTENT.unpack(bytes_[1:35])
            told = _CONTENT.pack(
                int(frames.status[row]),
                *frames.wrench[row].tolist(),
                int(frames.time_us[row]),
                float(frames.temperature_c[row]),
            )
            agree(told, _CONTENT.pack(status, *values, clock, temperature), "frame")
            agree((bytes_[0], bytes_[35:]), (0xAA, struct.pack("<H", _crc(bytes_[1:35]))), "header and CRC")
            if begin < last_end:
                raise WrongValueError(f"the frame at byte {begin} follows one that ends at {last_end}")
            if not (on_boundaries(stream, begin, end) or _is_sent(stream, begin, end)):
                raise WrongValueError(f"the frame at byte {begin} is made of two")
            last_end = end
    return last_end > 0


def _is_sent(stream: DamagedStream, begin: int, end: int) -> bool:
    """Tell whether a stretch is the frame that was sent with its last byte.

    It need not have begun there: where a frame's CRC ends in 0xAA, that byte stands for a lost header after it.
    """
    last = stream.origins[end - 1]
    return stream.sent[last + 1 - _SIZE : last + 1] == stream.arrived[begin:end]


TARGETS = (
    Target("bota-frames", "the bytes' origin and an independent CRC: no frame made of two", _stream, _check),
)
