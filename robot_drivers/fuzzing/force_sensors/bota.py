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
    """Judge the frames that the decoder delivers.

    Each is what the bytes before its end say. Each is, byte for byte, one that was sent after those before it; or it
    lies between two boundaries of the sender behind the one before it, so that a change has left it its length and its
    CRC, which nothing can see. The bytes of one that was sent may be others' where they are alike: a CRC that ends in
    0xAA may end with the next header, a frame whose header was lost begin in a CRC.
    """
    decoder = FrameDecoder()
    sent = {
        stream.sent[place : place + _SIZE]: number
        for number, place in enumerate(range(0, len(stream.sent), _SIZE))
    }
    last_end = last_number = -1
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
            number = sent.get(bytes_)
            if number is None and not (on_boundaries(stream, begin, end) and begin >= last_end):
                raise WrongValueError(f"the frame at byte {begin} is made of two")
            if number is not None and (number <= last_number or end <= last_end):
                raise WrongValueError(f"the frame at byte {begin} comes after the one that was sent after it")
            last_end, last_number = end, last_number if number is None else number
    return last_end > 0


TARGETS = (
    Target("bota-frames", "the bytes' origin and an independent CRC: no frame made of two", _stream, _check),
)
