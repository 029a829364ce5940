"""The TCP command interface of a Net F/T box (port 49151): readings, factors, tool transform.

Every request has 20 bytes, every answer begins with 0x1234, all big-endian and packed. Source: ATI
9620-05-Net FT, chapter on the TCP interface.
"""

import socket
import struct
from dataclasses import dataclass
from enum import IntEnum
from types import TracebackType
from typing import Self

import numpy as np

from robot_drivers.ati.transducer.scaling import FORCE_UNIT_BY_CODE, TORQUE_UNIT_BY_CODE, Scaling
from robot_drivers.errors import (
    ConfigurationError,
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.protocols import FloatArray

_HEADER = 0x1234
_READFT, _READCALINFO, _WRITETRANSFORM = 0, 1, 2
_LARGEST_COMPONENT = 327.67
_TRANSFORM_REQUEST = struct.Struct(">BBB6h5x")
_READING = struct.Struct(">HH6h")
_CALIBRATION = struct.Struct(">HBBII6H")
_WRITE_ANSWER = struct.Struct(">HBB")

READFT_REQUEST = bytes([_READFT]) + bytes(19)
READCALINFO_REQUEST = bytes([_READCALINFO]) + bytes(19)


class DistanceUnit(IntEnum):
    """Unit of a tool transform's translation."""

    INCH = 1
    FOOT = 2
    MILLIMETRE = 3
    CENTIMETRE = 4
    METRE = 5


class AngleUnit(IntEnum):
    """Unit of a tool transform's rotation."""

    DEGREE = 1
    RADIAN = 2


@dataclass(frozen=True, slots=True)
class CalibrationInfo:
    """Answer to READCALINFO; ``scale_factors`` are counts per 16-bit count, Fx Fy Fz Tx Ty Tz."""

    scaling: Scaling
    scale_factors: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Reading:
    """Answer to READFT: the upper half of the status word in its place, and six 16-bit counts."""

    status: int
    counts16: tuple[int, ...]

    def wrench(self, calibration: CalibrationInfo) -> FloatArray:
        """Return the reading in N and N·m, (6,)."""
        counts = np.multiply(self.counts16, calibration.scale_factors, dtype=np.float64)
        return counts * calibration.scaling.si_per_count


def parse_reading(answer: bytes) -> Reading:
    """Decode the 16 bytes that answer READFT."""
    header, status, *counts = _unpack(_READING, answer, "READFT")
    _check_header(header, "READFT")
    return Reading(status << 16, tuple(counts))


def parse_calibration(answer: bytes) -> CalibrationInfo:
    """Decode the 24 bytes that answer READCALINFO."""
    header, force, torque, per_force, per_torque, *factors = _unpack(_CALIBRATION, answer, "READCALINFO")
    _check_header(header, "READCALINFO")
    if force not in FORCE_UNIT_BY_CODE or torque not in TORQUE_UNIT_BY_CODE:
        raise DeviceProtocolError(f"READCALINFO tells unknown unit codes: force {force}, torque {torque}")
    if not all(factors):
        raise DeviceProtocolError(f"READCALINFO tells scale factors {factors}: 0 would hide an axis")
    scaling = Scaling(FORCE_UNIT_BY_CODE[force], TORQUE_UNIT_BY_CODE[torque], per_force, per_torque)
    return CalibrationInfo(scaling, tuple(factors))


def transform_request(
    translation: tuple[float, float, float],
    rotation: tuple[float, float, float],
    distance_unit: DistanceUnit,
    angle_unit: AngleUnit,
) -> bytes:
    """Encode WRITETRANSFORM; the box takes hundredths of the units in 16 bits.

    Raises
    ------
    ConfigurationError
        A component does not fit (±327.67), or is finer than a hundredth.
    """
    hundredths = [_hundredths(value) for value in (*translation, *rotation)]
    return _TRANSFORM_REQUEST.pack(_WRITETRANSFORM, distance_unit, angle_unit, *hundredths)


def _hundredths(value: float) -> int:
    if not abs(value) <= _LARGEST_COMPONENT or abs(100 * value - round(100 * value)) > 1e-6:
        raise ConfigurationError(
            f"tool transform component {value}: must be within ±{_LARGEST_COMPONENT} and a multiple of 0.01; "
            "choose other units"
        )
    return round(100 * value)


def parse_write_answer(answer: bytes) -> None:
    """Check the 4 bytes that answer WRITETRANSFORM.

    Raises
    ------
    DeviceFaultError
        The box refused.
    """
    header, command, status = _unpack(_WRITE_ANSWER, answer, "WRITETRANSFORM")
    _check_header(header, "WRITETRANSFORM")
    if command != _WRITETRANSFORM:
        raise DeviceProtocolError(f"WRITETRANSFORM was answered for command {command}")
    if status:
        raise DeviceFaultError(f"the sensor refused the tool transform with status {status}")


class CommandInterface:
    """One TCP connection to a box; a context manager that connects on entry."""

    def __init__(self, host: str, port: int = 49151, timeout_s: float = 2.0) -> None:
        self._address = (host, port)
        self._timeout_s = timeout_s
        self._socket = socket.socket()

    def __enter__(self) -> Self:
        self._socket.settimeout(self._timeout_s)
        try:
            self._socket.connect(self._address)
        except OSError as error:
            self._socket.close()
            raise DeviceUnreachableError(
                f"command interface {self._where} does not answer ({error}); check power, cable and address"
            ) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()

    def read_ft(self) -> Reading:
        """Read the present force and torque."""
        return parse_reading(self._ask(READFT_REQUEST, _READING.size))

    def read_calibration(self) -> CalibrationInfo:
        """Read units and factors."""
        return parse_calibration(self._ask(READCALINFO_REQUEST, _CALIBRATION.size))

    def write_transform(
        self,
        translation: tuple[float, float, float],
        rotation: tuple[float, float, float],
        distance_unit: DistanceUnit = DistanceUnit.MILLIMETRE,
        angle_unit: AngleUnit = AngleUnit.DEGREE,
    ) -> None:
        """Make the box report its wrench in a displaced frame; zeros restore the sensor's own frame."""
        request = transform_request(translation, rotation, distance_unit, angle_unit)
        parse_write_answer(self._ask(request, _WRITE_ANSWER.size))

    @property
    def _where(self) -> str:
        return "{}:{}".format(*self._address)

    def _ask(self, request: bytes, answer_size: int) -> bytes:
        """Send a request and read exactly its answer: TCP may deliver it in pieces."""
        answer = b""
        try:
            self._socket.sendall(request)
            while len(answer) < answer_size:
                piece = self._socket.recv(answer_size - len(answer))
                if not piece:
                    raise DeviceProtocolError(
                        f"command interface {self._where} closed after {len(answer)} of {answer_size} bytes"
                    )
                answer += piece
        except TimeoutError as error:
            raise DeviceTimeoutError(
                f"command interface {self._where} sent {len(answer)} of {answer_size} bytes "
                f"in {self._timeout_s} s"
            ) from error
        except OSError as error:
            raise DeviceUnreachableError(f"command interface {self._where} broke off: {error}") from error
        return answer


def _unpack(layout: struct.Struct, answer: bytes, command: str) -> tuple[int, ...]:
    if len(answer) != layout.size:
        raise DeviceProtocolError(f"{command} was answered with {len(answer)} bytes instead of {layout.size}")
    return layout.unpack(answer)


def _check_header(header: int, command: str) -> None:
    if header != _HEADER:
        raise DeviceProtocolError(
            f"{command} was answered with header {header:#06x} instead of {_HEADER:#06x}"
        )
