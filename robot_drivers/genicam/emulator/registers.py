"""The registers of the emulated camera: GigE Vision's bootstrap registers, and those of its own features."""

import ipaddress
import struct
from collections.abc import Callable

from robot_drivers.genicam.emulator import description as of
from robot_drivers.genicam.emulator.settings import PIXEL_FORMATS, GigECameraSettings

DISCOVERY_BYTES = 0xF8
HEARTBEAT_TIMEOUT, CONTROL_PRIVILEGE = 0x938, 0xA00
STREAM_PORT, STREAM_PACKET_SIZE, STREAM_ADDRESS = 0xD00, 0xD04, 0xD18
STREAM_CAPABILITY, STREAM_CONFIGURATION, MULTIPART = 0xD20, 0xD24, 0x40
_DEFAULT_PACKET_BYTES = 1500
_DEFAULT_HEARTBEAT_MS = 3000
_XML_ADDRESS = 0x10000
_TICKS_PER_S = 1_000_000_000


class Registers:
    """Memory of the camera, big-endian; what depends on the time is told by functions.

    Parameters
    ----------
    settings : what the camera is like
    told : by address, what a reading of the register gives instead of what was written
    """

    def __init__(self, settings: GigECameraSettings, told: dict[int, Callable[[], int]]) -> None:
        self._told = told
        xml = of.description(settings)
        self._memory = bytearray(_XML_ADDRESS + len(xml) + 512)
        self._memory[_XML_ADDRESS : _XML_ADDRESS + len(xml)] = xml
        for address, value in (
            (0x00, 0x0001_0002),
            (0x04, 0x8000_0001),
            (0x08, 0x0000_0200),
            (0x0C, int(ipaddress.IPv4Address(settings.host))),
            (0x10, 0x8000_0005),
            (0x14, 0x0000_0005),
            (0x24, int(ipaddress.IPv4Address(settings.host))),
            (0x34, 0xFF00_0000),
            (0x600, 1),
            (0x904, 1),
            (0x934, 0x4000_0002),
            (HEARTBEAT_TIMEOUT, _DEFAULT_HEARTBEAT_MS),
            (0x93C, _TICKS_PER_S >> 32),
            (0x940, _TICKS_PER_S & 0xFFFF_FFFF),
            (STREAM_PACKET_SIZE, _DEFAULT_PACKET_BYTES),
            (of.WIDTH, settings.width),
            (of.HEIGHT, settings.height),
            (of.PIXEL_FORMAT, PIXEL_FORMATS[settings.pixel_format]),
        ):
            self.write(address, value)
        for address, text in (
            (0x48, settings.vendor),
            (0x68, settings.model),
            (0x88, "1.0"),
            (0xD8, settings.serial),
            (0x200, f"Local:camera.xml;{_XML_ADDRESS:X};{len(xml):X}"),
        ):
            self._memory[address : address + len(text)] = text.encode()
        numbers = {of.FRAME_RATE: settings.fps}
        if settings.depth is not None:
            self.write(STREAM_CAPABILITY, MULTIPART)
            registers, numbers = (
                of.depth_registers(settings.depth),
                numbers | of.depth_numbers(settings.depth),
            )
            for address, value in registers.items():
                self.write(address, value)
        for address, number in numbers.items():
            self._memory[address : address + 8] = struct.pack(">d", number)

    def read(self, address: int) -> int:
        """Return a register of 32 bits; raises IndexError where there is none."""
        if address in self._told:
            return self._told[address]()
        self._check(address, 4)
        return int.from_bytes(self._memory[address : address + 4], "big")

    def write(self, address: int, value: int) -> None:
        """Set a register of 32 bits; raises IndexError where there is none."""
        self._check(address, 4)
        self._memory[address : address + 4] = value.to_bytes(4, "big")

    def read_memory(self, address: int, size: int) -> bytes:
        """Return a piece of the memory; registers that are told are current. Raises IndexError where there is none."""
        self._check(address, size)
        for told in range(address & ~3, address + size, 4):
            if told in self._told:
                self.write(told, self.read(told))
        return bytes(self._memory[address : address + size])

    def _check(self, address: int, size: int) -> None:
        if address + size > len(self._memory):
            raise IndexError(f"no memory at {address:#x}")
