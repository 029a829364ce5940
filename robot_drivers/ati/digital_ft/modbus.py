"""Modbus RTU as far as an ATI Digital F/T speaks it: registers, and functions of the vendor with one byte.

Source: Modbus over Serial Line V1.02, chapter 2.5 and appendix B (CRC); Modbus Application Protocol V1.1b3.
"""

import struct
import time
from collections.abc import Sequence

from robot_drivers.errors import DeviceFaultError, DeviceProtocolError, DeviceTimeoutError
from robot_drivers.serial_line.line import SerialLine

READ_HOLDING, WRITE_HOLDING = 0x03, 0x10
MAX_REGISTERS_READ = 125

_ACCEPTED = 1
_EXCEPTION_BIT = 0x80
_EXCEPTIONS = {
    1: "illegal function",
    2: "illegal address",
    3: "illegal value",
    4: "device failure",
    6: "busy",
}
_SHORTEST_ANSWER = 5  # bytes: address, function, one byte, CRC
_ATTEMPTS = 3
_PAUSE_S = 0.002
"""Silence that ends a frame: 3.5 characters, and never less than 1.75 ms."""


def crc16(data: bytes) -> int:
    """Return the CRC of Modbus: polynomial 0xA001 (reflected), begun with 0xFFFF; sent low byte first."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


def framed(body: bytes) -> bytes:
    """Append the CRC."""
    return body + struct.pack("<H", crc16(body))


def read_request(address: int, function: int, register: int, count: int) -> bytes:
    """Encode a request to read ``count`` registers."""
    return framed(struct.pack(">BBHH", address, function, register, count))


def write_request(address: int, register: int, values: Sequence[int]) -> bytes:
    """Encode a request to write 16-bit values to consecutive holding registers."""
    count = len(values)
    return framed(struct.pack(f">BBHHB{count}H", address, WRITE_HOLDING, register, count, 2 * count, *values))


def vendor_request(address: int, function: int, value: int) -> bytes:
    """Encode a request of the vendor's own, which carries one byte."""
    return framed(bytes([address, function, value]))


def checked_answer(request: bytes, answer: bytes) -> bytes:
    """Return an answer without its CRC.

    Raises
    ------
    DeviceProtocolError
        It is damaged, or answers another device or function.
    DeviceFaultError
        The device refuses.
    """
    if (
        len(answer) < _SHORTEST_ANSWER
        or answer[:1] != request[:1]
        or answer[1] & ~_EXCEPTION_BIT != request[1]
        or framed(answer[:-2]) != answer
    ):
        raise DeviceProtocolError(
            f"Modbus: {request.hex(' ')} was answered with {answer.hex(' ')}, which is damaged; "
            "check bit rate, wiring and termination"
        )
    if answer[1] & _EXCEPTION_BIT:
        reason = _EXCEPTIONS.get(answer[2], "undocumented")
        raise DeviceFaultError(f"the device refused {request.hex(' ')}: {reason} (exception {answer[2]})")
    return answer[:-2]


class ModbusMaster:
    """Talks to one device on a line that is otherwise silent.

    Raises
    ------
    DeviceTimeoutError
        No answer, or a part of one, three times in a row; from every method.
    DeviceProtocolError
        An answer that is damaged or to another question, three times in a row.
    DeviceFaultError
        The device refuses.
    """

    def __init__(self, line: SerialLine, address: int, timeout_s: float) -> None:
        self._line = line
        self._address = address
        self._timeout_s = timeout_s

    def read_holding(self, register: int, count: int) -> bytes:
        """Return ``count`` holding registers, two bytes each, high byte first; read in chunks that fit."""
        chunks = []
        for first in range(register, register + count, MAX_REGISTERS_READ):
            size = min(MAX_REGISTERS_READ, register + count - first)
            request = read_request(self._address, READ_HOLDING, first, size)
            head = bytes([*request[:2], 2 * size])
            chunks.append(self._ask(request, 3 + 2 * size, head)[3:])
        return b"".join(chunks)

    def write_holding(self, register: int, values: Sequence[int]) -> None:
        """Write 16-bit values to consecutive holding registers."""
        request = write_request(self._address, register, values)
        self._ask(request, 6, request[:6])

    def command(self, function: int, value: int) -> None:
        """Have a function of the vendor carried out. What the device sends after its answer stays on the line."""
        request = vendor_request(self._address, function, value)
        answer = self._ask(request, 3, request[:2])
        if answer[2] != _ACCEPTED:
            raise DeviceFaultError(
                f"the device refused function {function:#04x} with {value:#04x}: {answer[2]}"
            )

    def _ask(self, request: bytes, answer_size: int, head: bytes) -> bytes:
        """Return the answer without its CRC, which begins with ``head``.

        It is asked for again when it was lost or damaged on its way, and when one came late, to an earlier question.
        """
        for _ in range(_ATTEMPTS - 1):
            try:
                return self._ask_once(request, answer_size, head)
            except (DeviceProtocolError, DeviceTimeoutError):
                self._line.read_until_silent()
        return self._ask_once(request, answer_size, head)

    def _ask_once(self, request: bytes, answer_size: int, expected: bytes) -> bytes:
        time.sleep(_PAUSE_S)
        self._line.read()  # an answer that came late, to a question given up
        self._line.write(request)
        head = self._line.read_exactly(3, self._timeout_s)
        refused = head[0] == request[0] and head[1] == request[1] | _EXCEPTION_BIT
        rest = self._line.read_exactly(2 if refused else answer_size - 1, self._timeout_s)
        answer = checked_answer(request, head + rest)
        if not answer.startswith(expected):
            raise DeviceProtocolError(
                f"Modbus: {request.hex(' ')} was answered with {answer.hex(' ')}, which answers another question; "
                "is there a second master on the line?"
            )
        return answer
