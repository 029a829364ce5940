"""Fuzz targets: the serial force sensors - Modbus answers, calibration record, byte streams."""

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from random import Random

import numpy as np

from robot_drivers.ati.controller_ft.records import AsciiDecoder, BinaryDecoder
from robot_drivers.ati.digital_ft.modbus import checked_answer
from robot_drivers.ati.digital_ft.protocol import SampleDecoder, parse_calibration
from robot_drivers.ati.serial.framing import Decoder
from robot_drivers.ati.transducer.gages import FT33206
from robot_drivers.errors import DeviceFaultError, DeviceProtocolError
from robot_drivers.fuzzing.mutations import mutated, overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree

_REQUEST = bytes.fromhex("0A 03 00 1D 00 01")
_UNKNOWN = -1  # origin of a byte that was not sent

_CALIBRATION = struct.pack(
    ">8s32s4s20s36fBB6fii6H6H",
    *(b"FT33206", b"SI-130-10", b"Net", b"2021-01-1905:00:00Z"),
    *FT33206.matrix.ravel(),
    *(2, 3, 130.0, 130.0, 400.0, 10.0, 10.0, 10.0, 1_000_000, 1_000_000),
    *FT33206.gains,
    *FT33206.offsets,
).ljust(336, b"\0")


def _modbus_answer(random: Random) -> bytes:
    """Return an answer to the request for one register; every other one with a right checksum."""
    answer = mutated(random, [b"\x0a\x03\x02\x00\x00", b"\x0a\x83\x02", b"\x0a\x03\x02\x20\x01"])
    return answer + struct.pack("<H", _crc(answer)) if random.random() < 0.5 else answer


def _check_modbus_answer(answer: bytes) -> bool:
    content = checked_answer(_REQUEST, answer)
    agree(answer[-2:], struct.pack("<H", _crc(answer[:-2])), "checksum of what was taken")
    agree((answer[:2], content), (_REQUEST[:2], answer[:-2]), "answer")
    return True


def _crc(data: bytes) -> int:
    """Modbus' CRC by long division of the reversed bits, which is not how the driver goes about it."""
    remainder = 0xFFFF
    for byte in data:
        remainder ^= _reversed_bits(byte, 8) << 8
        for _ in range(8):
            remainder = remainder << 1 ^ (0x18005 if remainder & 0x8000 else 0)
    return _reversed_bits(remainder, 16)


def _reversed_bits(value: int, width: int) -> int:
    return int(f"{value:0{width}b}"[::-1], 2)


def _check_calibration(record: bytes) -> bool:
    calibration = parse_calibration(record)
    agree(calibration.matrix.astype(">f4").tobytes(), record[64:208], "calibration matrix")
    agree(struct.pack(">6H", *calibration.gains), record[242:254], "gains")
    agree(struct.pack(">6H", *calibration.offsets), record[254:266], "offsets")
    scaling = calibration.scaling
    counts = struct.pack(">ii", int(scaling.counts_per_force), int(scaling.counts_per_torque))
    agree(counts, record[234:242], "counts per unit")
    if not np.isfinite(calibration.si_per_gage).all() or not np.linalg.cond(calibration.matrix) < 1e7:
        raise WrongValueError("a matrix that no transducer has was taken for good")
    return True


@dataclass(frozen=True, slots=True)
class DamagedStream:
    """What arrived of a stream of records, and from which byte sent each byte came, unchanged."""

    record_size: int
    sent: bytes
    arrived: bytes
    origins: tuple[int, ...]
    pieces: tuple[int, ...]

    def chunks(self) -> list[bytes]:
        """The bytes in the pieces in which the host reads them."""
        ends = [*self.pieces, len(self.arrived)]
        return [self.arrived[begin:end] for begin, end in zip([0, *ends], ends, strict=False)]


def damaged(random: Random, record_size: int, sent: bytes) -> DamagedStream:
    """Lose, change and add bytes, single ones and runs."""
    loss, change, insertion = (random.choice((0.0, 0.0, 0.002, 0.02)) for _ in range(3))
    arrived, origins = bytearray(), []
    skip = 0
    for place, byte in enumerate(sent):
        if skip:
            skip -= 1
            continue
        draw = random.random()
        if draw < loss:
            skip = random.choice((0, 0, 0, random.randrange(3 * record_size)))
        elif draw < loss + change:
            arrived.append(random.randrange(256))
            origins.append(_UNKNOWN)
        else:
            arrived.append(byte)
            origins.append(place)
        if random.random() < insertion:
            rubbish = random.randbytes(random.choice((1, 1, 1, random.randrange(3 * record_size))))
            arrived += rubbish
            origins += [_UNKNOWN] * len(rubbish)
    pieces = sorted(random.randrange(len(arrived) + 1) for _ in range(random.randrange(4)))
    return DamagedStream(record_size, sent, bytes(arrived), tuple(origins), tuple(pieces))


def _check_stream(
    stream: DamagedStream, decoder: Decoder, encoded: Callable[[int, list[int]], bytes], ends_can_lie: bool
) -> bool:
    """Judge every record that a decoder delivers.

    Always: it is what the bytes before its end say, records do not overlap, and their indices grow. Unless
    ``ends_can_lie`` (no protection at all in the protocol), also: it lies between two record boundaries of the sender,
    so that it is a true record, or one whose change left it its length and its check, which nothing can see.
    """
    last_end = last_index = -1
    delivered = 0
    for chunk in stream.chunks():
        records = decoder.feed(chunk)
        rows = zip(
            records.status, records.values.tolist(), records.index.tolist(), records.end.tolist(), strict=True
        )
        for status, values, index, end in rows:
            begin = end - stream.record_size
            agree(encoded(int(status), values), stream.arrived[begin:end], f"record that ends at byte {end}")
            if begin < last_end or index <= last_index:
                raise WrongValueError(
                    f"record {index} at byte {begin} follows {last_index} that ends at {last_end}"
                )
            if not (ends_can_lie or on_boundaries(stream, begin, end)):
                raise WrongValueError(f"record {index} at byte {begin} is made of two")
            last_end, last_index = end, index
            delivered += 1
    return delivered > 0


def on_boundaries(stream: DamagedStream, begin: int, end: int) -> bool:
    """Tell whether a stretch of what arrived begins and ends where a record of the sender may.

    A boundary is where a record of the sender begins or one ends; bytes that were not sent can hide one.
    """
    return _is_boundary(stream, begin) and _is_boundary(stream, end)


def _is_boundary(stream: DamagedStream, place: int) -> bool:
    before = stream.origins[place - 1] if place else _UNKNOWN
    after = stream.origins[place] if place < len(stream.origins) else _UNKNOWN
    begins = after != _UNKNOWN and after % stream.record_size == 0
    ends = before != _UNKNOWN and (before + 1) % stream.record_size == 0
    return begins or ends or _UNKNOWN in (before, after)


def _gage_stream(random: Random) -> DamagedStream:
    """Samples of a loaded sensor: six gages with noise, in the order of the wire."""
    load = [random.randrange(-20000, 20000) for _ in range(6)]
    samples = bytearray()
    for _ in range(random.randrange(1, 70)):
        body = struct.pack(">6h", *(gage + random.randrange(-40, 41) for gage in load))
        samples += body + bytes([sum(body) & 0x7F])
    return damaged(random, 13, bytes(samples))


def _check_gage_stream(stream: DamagedStream) -> bool:
    def encoded(status: int, gages: list[int]) -> bytes:
        body = struct.pack(">6h", *(gages[i] for i in (0, 2, 4, 1, 3, 5)))
        return body + bytes([status << 7 | sum(body) & 0x7F])

    return _check_stream(stream, SampleDecoder(), encoded, ends_can_lie=False)


def _ascii_stream(random: Random) -> DamagedStream:
    load = [random.randrange(-1300, 1300) for _ in range(6)]
    lines = [
        "0," + ",".join(f"{count + random.randrange(-9, 10):6d}" for count in load) + "\r\n"
        for _ in range(random.randrange(1, 30))
    ]
    return damaged(random, 45, "".join(lines).encode())


def _check_ascii_stream(stream: DamagedStream) -> bool:
    """Judge ASCII records: each is what the line says that ends where it ends, read by another pattern."""
    decoder, delivered, last_index = AsciiDecoder(16), 0, -1
    for chunk in stream.chunks():
        records = decoder.feed(chunk)
        rows = zip(
            records.status, records.values.tolist(), records.index.tolist(), records.end.tolist(), strict=True
        )
        for status, values, index, end in rows:
            line = stream.arrived[:end].rsplit(b"\r", 2)[-2].removeprefix(b"\n").decode("latin-1")
            found = re.fullmatch(r"([0-9])" + r",([ ]*-?[0-9]+)" * 6, line)
            if found is None or len(line) != 43:
                raise WrongValueError(f"{line!r} was taken for a record")
            agree([int(status), *values], [int(field) for field in found.groups()], "record")
            if index <= last_index:
                raise WrongValueError(f"index {index} after {last_index}")
            last_index = index
            delivered += 1
    return delivered > 0


def _binary_stream(random: Random) -> DamagedStream:
    load = [random.randrange(-1300, 1300) for _ in range(6)]
    records = [
        b"\0" + struct.pack(">6h", *(count + random.randrange(-9, 10) for count in load)) for _ in range(40)
    ]
    return damaged(random, 13, b"".join(records))


def _check_binary_stream(stream: DamagedStream) -> bool:
    largest = np.array([3250.0, 3250.0, 10000.0, 4167.0, 4167.0, 4167.0])

    def encoded(flag: int, counts: list[int]) -> bytes:
        if flag > 9 or (np.abs(counts) > largest).any():
            raise WrongValueError(f"flag {flag} and counts {counts} were taken for good")
        return bytes([flag]) + struct.pack(">6h", *counts)

    return _check_stream(stream, BinaryDecoder(16, largest), encoded, ends_can_lie=True)


TARGETS = (
    Target(
        "modbus-answer",
        "an independent CRC holds and the answer is to the request",
        _modbus_answer,
        _check_modbus_answer,
        (DeviceProtocolError, DeviceFaultError),
    ),
    Target(
        "digital-calibration",
        "encoded again, the same bytes; matrix finite and invertible",
        lambda random: (mutated if random.random() < 0.3 else overwritten)(random, [_CALIBRATION]),
        _check_calibration,
    ),
    Target(
        "digital-stream",
        "the bytes' origin: no record made of two, none twice",
        _gage_stream,
        _check_gage_stream,
    ),
    Target("controller-ascii", "another pattern reads the same line", _ascii_stream, _check_ascii_stream),
    Target(
        "controller-binary",
        "the bytes before its end, flag and counts in range (the format has no check)",
        _binary_stream,
        _check_binary_stream,
    ),
)
