"""The CAN frames of an ATI NETCANOEM board: requests to it, answers from it. Everything is big-endian.

A frame's identifier is (base << 4) | opcode. The board answers a request for gages with two frames, the even
gages first. Source: ATI 9610-05-1030 (F/T CAN Bus and Serial Bus Network Interface for OEM), sections 4, 7
and 10.
"""

import struct
from collections.abc import Mapping, Sequence
from enum import IntEnum

import numpy as np

from robot_drivers.ati.can.link import Request
from robot_drivers.ati.transducer.scaling import FORCE_UNIT_BY_CODE, TORQUE_UNIT_BY_CODE, Scaling
from robot_drivers.errors import DeviceProtocolError
from robot_drivers.protocols import FloatArray

DEFAULT_BASE = 0x20


class Opcode(IntEnum):
    """What a frame asks for or carries."""

    GAGES = 0x0
    ODD_GAGES = 0x1
    MATRIX_ROW = 0x2
    MATRIX_ROW_MIDDLE = 0x3
    MATRIX_ROW_END = 0x4
    SERIAL = 0x5
    CALIBRATION = 0x6
    COUNTS_PER_UNIT = 0x7
    UNITS = 0x8
    FIRMWARE = 0xF


# the frames that answer each request, in order, and how many bytes each has
_ANSWER_LENGTHS: Mapping[Opcode, Mapping[Opcode, int]] = {
    Opcode.GAGES: {Opcode.GAGES: 8, Opcode.ODD_GAGES: 6},
    Opcode.MATRIX_ROW: {Opcode.MATRIX_ROW: 8, Opcode.MATRIX_ROW_MIDDLE: 8, Opcode.MATRIX_ROW_END: 8},
    Opcode.SERIAL: {Opcode.SERIAL: 8},
    Opcode.CALIBRATION: {Opcode.CALIBRATION: 1},
    Opcode.COUNTS_PER_UNIT: {Opcode.COUNTS_PER_UNIT: 8},
    Opcode.UNITS: {Opcode.UNITS: 2},
    Opcode.FIRMWARE: {Opcode.FIRMWARE: 4},
}

STATUS_WORDS: Mapping[int, str] = {
    0: "watchdog reset (a warning)",
    1: "DAC/ADC check too high",
    2: "DAC/ADC check too low",
    3: "artificial analog ground out of range",
    4: "supply voltage too high",
    5: "supply voltage too low",
    6: "active calibration is empty or damaged",
    7: "EEPROM failure",
    8: "configuration invalid, defaults in use",
    11: "temperature too high",
    12: "temperature too low",
    14: "CAN bus error",
    15: "summary: another bit is set",
}
CRITICAL_STATUS = sum(1 << bit for bit in (1, 2, 3, 4, 5, 6, 7, 11, 12))
"""Status bits that the manual calls critical: the board goes on sending, but its samples are not usable."""


def identifier(base: int, opcode: Opcode) -> int:
    """Return the 11-bit identifier of a frame of the board with this 7-bit base (0x200 for base 0x20)."""
    return base << 4 | opcode


def request(base: int, opcode: Opcode, data: bytes = b"") -> Request:
    """Return a request to the board with this 7-bit base, and the frames that answer it."""
    answers = tuple((identifier(base, answer), size) for answer, size in _ANSWER_LENGTHS[opcode].items())
    return Request(opcode.name, identifier(base, opcode), data, answers)


def decode_gages(even: bytes, odd: bytes) -> tuple[int, tuple[int, ...]]:
    """Decode the answer to a request for gages: status word and the readings of gages 0..5."""
    status, gage0, gage2, gage4 = struct.unpack(">H3h", even)
    gage1, gage3, gage5 = struct.unpack(">3h", odd)
    return status, (gage0, gage1, gage2, gage3, gage4, gage5)


def decode_matrix(rows: Sequence[bytes]) -> FloatArray:
    """Decode the six rows of the active calibration, 24 bytes each: counts per gage count, (6, 6)."""
    return np.frombuffer(b"".join(rows), ">f4").astype(np.float64).reshape(6, 6)


def decode_scaling(counts_per_unit: bytes, units: bytes) -> Scaling:
    """Decode counts per force and torque, and the codes of their units."""
    per_force, per_torque = struct.unpack(">II", counts_per_unit)
    force, torque = units
    if force not in FORCE_UNIT_BY_CODE or torque not in TORQUE_UNIT_BY_CODE:
        raise DeviceProtocolError(f"the board tells unknown unit codes: force {force}, torque {torque}")
    return Scaling(FORCE_UNIT_BY_CODE[force], TORQUE_UNIT_BY_CODE[torque], per_force, per_torque)


def decode_serial(answer: bytes) -> str:
    """Decode the transducer's serial number; padding is dropped."""
    return answer.decode("ascii", errors="replace").strip(" \0")


def decode_firmware(answer: bytes) -> tuple[int, int, int]:
    """Decode the firmware's version: major, minor, build."""
    major, minor, build = struct.unpack(">BBH", answer)
    return major, minor, build
