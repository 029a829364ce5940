"""GVCP, the control protocol of GigE Vision, at the camera's end: requests of UDP port 3956 and their answers.

Sources: the protocol's public dissector in Wireshark (packet-gvcp.c) and the headers of Aravis; the standard itself is
not public.
"""

import struct
from collections.abc import Callable

from robot_drivers.clock import host_time_ns
from robot_drivers.genicam.emulator.registers import (
    CONTROL_PRIVILEGE,
    DISCOVERY_BYTES,
    HEARTBEAT_TIMEOUT,
    Registers,
)

PORT = 3956

_KEY = 0x42
_HEADER = struct.Struct(">BBHHH")
_ANSWER = struct.Struct(">HHHH")
_DISCOVERY, _READ_REGISTERS, _WRITE_REGISTERS, _READ_MEMORY, _WRITE_MEMORY = 0x02, 0x80, 0x82, 0x84, 0x86
_NOT_IMPLEMENTED, _INVALID_PARAMETER, _INVALID_ADDRESS, _ACCESS_DENIED = 0x8001, 0x8002, 0x8003, 0x8006

Address = tuple[str, int]


class ControlChannel:
    """Answers requests; only who has taken control may write.

    Parameters
    ----------
    registers : of the camera
    written : called with address and value of a register that was written
    """

    def __init__(self, registers: Registers, written: Callable[[int, int], None]) -> None:
        self._registers = registers
        self._written = written
        self._controller: Address | None = None
        self._heard_ns = 0

    @property
    def controlled(self) -> bool:
        """Whether somebody has taken control and goes on asking."""
        if self._controller is not None:
            silent_ms = (host_time_ns() - self._heard_ns) * 1e-6
            if silent_ms > self._registers.read(HEARTBEAT_TIMEOUT):
                self._controller = None
                self._registers.write(CONTROL_PRIVILEGE, 0)
        return self._controller is not None

    def answer(self, request: bytes, peer: Address) -> bytes | None:
        """Return the answer to a datagram; None where there is none."""
        if len(request) < _HEADER.size:
            return None
        key, _, command, size, number = _HEADER.unpack_from(request)
        content = request[_HEADER.size :]
        if key != _KEY or len(content) != size:
            return None
        if self.controlled and peer == self._controller:
            self._heard_ns = host_time_ns()
        try:
            status, told = self._obey(command, content, peer)
        except struct.error:
            status, told = _INVALID_PARAMETER, b""
        except IndexError:
            status, told = _INVALID_ADDRESS, b""
        return _ANSWER.pack(status, command + 1, len(told), number) + told

    def _obey(self, command: int, content: bytes, peer: Address) -> tuple[int, bytes]:
        registers = self._registers
        if command == _DISCOVERY:
            return 0, registers.read_memory(0, DISCOVERY_BYTES)
        if command == _READ_REGISTERS:
            addresses = struct.unpack(f">{len(content) // 4}I", content)
            return 0, b"".join(registers.read(address).to_bytes(4, "big") for address in addresses)
        if command == _READ_MEMORY:
            address, count = struct.unpack(">I2xH", content)
            return 0, content[:4] + registers.read_memory(address, count)
        if command in (_WRITE_REGISTERS, _WRITE_MEMORY):
            return self._write(command, content, peer)
        return _NOT_IMPLEMENTED, b""

    def _write(self, command: int, content: bytes, peer: Address) -> tuple[int, bytes]:
        if command == _WRITE_REGISTERS:
            pairs = list(struct.iter_unpack(">II", content))
        else:
            (address,) = struct.unpack_from(">I", content)
            values = struct.unpack_from(f">{(len(content) - 4) // 4}I", content, 4)
            pairs = [(address + 4 * place, value) for place, value in enumerate(values)]
        for address, value in pairs:
            taking = address == CONTROL_PRIVILEGE and not self.controlled
            if not taking and peer != self._controller:
                return _ACCESS_DENIED, b""
            if address == CONTROL_PRIVILEGE:
                self._controller = peer if value else None
                self._heard_ns = host_time_ns()
            self._registers.write(address, value)
            self._written(address, value)
        return 0, struct.pack(">2xH", len(pairs))
