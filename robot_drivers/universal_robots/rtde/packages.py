"""Packages of RTDE, protocol version 2, as bytes.

A package is its length (two bytes, with itself and the next byte), a letter that tells its kind, and its content; all
numbers are big-endian. Source: the Real-Time Data Exchange guide of Universal Robots, from software 3.3 / 5.0 on.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from robot_drivers.errors import DeviceProtocolError

PROTOCOL_VERSION = 2
HEADER = struct.Struct(">HB")
LONGEST = 0xFFFF
_LARGEST = 1e12  # of a measured number, in whatever unit: its square is still one

Value = int | float | bool | tuple[float, ...] | tuple[int, ...]

_FORMATS = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}
_REFUSALS = {"NOT_FOUND": "is not known to this controller", "IN_USE": "is written by another client"}


class Kind(IntEnum):
    """What a package is, by its letter."""

    PROTOCOL = ord("V")
    CONTROLLER = ord("v")
    TEXT = ord("M")
    DATA = ord("U")
    OUTPUTS = ord("O")
    INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


_LETTERS = frozenset(kind.value for kind in Kind)


@dataclass(frozen=True, slots=True)
class Package:
    """One package; ``content`` is what follows the letter."""

    kind: Kind
    content: bytes = b""

    def encode(self) -> bytes:
        """Return its bytes."""
        size = HEADER.size + len(self.content)
        if size > LONGEST:
            raise DeviceProtocolError(f"RTDE: a package of {size} bytes, at most {LONGEST} fit")
        return HEADER.pack(size, self.kind) + self.content


def take_package(received: bytearray) -> Package | None:
    """Take the first package off what was received; None where it is not whole yet.

    Raises
    ------
    DeviceProtocolError
        It is no package: what follows cannot be told apart any more.
    """
    if len(received) < HEADER.size:
        return None
    size, letter = HEADER.unpack_from(received)
    if size < HEADER.size or letter not in _LETTERS:
        raise DeviceProtocolError(
            f"RTDE: {bytes(received[: HEADER.size]).hex()} begins no package; is it the port 30004 of a controller?"
        )
    if len(received) < size:
        return None
    package = Package(Kind(letter), bytes(received[HEADER.size : size]))
    del received[:size]
    return package


def accepted(package: Package) -> bool:
    """Return the verdict of an answer that is one byte: to a protocol version, to start and to pause."""
    if len(package.content) != 1 or package.content[0] > 1:
        raise DeviceProtocolError(f"RTDE: {package.content.hex()!r} is no verdict on {package.kind.name}")
    return package.content == b"\x01"


def controller_version(package: Package) -> str:
    """Return the version of the controller's software, such as ``5.11.1.108318``."""
    if len(package.content) != 16:
        raise DeviceProtocolError(f"RTDE: a version of {len(package.content)} bytes, not 16")
    return ".".join(map(str, struct.unpack(">4I", package.content)))


def text_of(package: Package) -> str:
    """Return a text message with the source that it names."""
    content = package.content
    try:
        length = content[0]
        text, rest = content[1 : 1 + length], content[1 + length :]
        source = rest[1 : 1 + rest[0]]
        if len(text) != length or len(source) != rest[0] or len(rest) != 2 + rest[0]:
            raise DeviceProtocolError("RTDE: a text message of another length than it says")
    except IndexError as error:
        raise DeviceProtocolError("RTDE: a text message that is cut off") from error
    return f"{source.decode('latin-1')}: {text.decode('latin-1')}"


@dataclass(frozen=True, slots=True)
class Recipe:
    """Which variables a data package holds, in which order.

    Attributes
    ----------
    number : that the controller has given it
    names, types : of the variables
    """

    number: int
    names: tuple[str, ...]
    types: tuple[str, ...]

    @classmethod
    def of_answer(cls, package: Package, names: Sequence[str]) -> "Recipe":
        """Return the recipe that a controller has made of these variables.

        Raises
        ------
        DeviceProtocolError
            It knows one of them not, another client writes it, or the answer is none.
        """
        if not package.content:
            raise DeviceProtocolError(f"RTDE: an empty answer to {package.kind.name}")
        types = tuple(package.content[1:].decode("latin-1").split(","))
        if len(types) != len(names):
            raise DeviceProtocolError(f"RTDE: {len(types)} types for {len(names)} variables")
        for name, kind in zip(names, types, strict=True):
            if kind not in _FORMATS:
                raise DeviceProtocolError(
                    f"RTDE: {name} {_REFUSALS.get(kind, f'is of unknown type {kind!r}')}"
                )
        return cls(package.content[0], tuple(names), types)

    def encode(self, values: Sequence[Value]) -> bytes:
        """Return the content of a data package with these values, in the order of the names."""
        numbers: list[float | int | bool] = []
        for value in values:
            numbers += value if isinstance(value, tuple) else (value,)
        return struct.pack(self._format, self.number, *numbers)

    def decode(self, content: bytes) -> dict[str, Value]:
        """Return the values of a data package by their names.

        Raises
        ------
        DeviceProtocolError
            It is of another recipe or length, or holds a number that is not finite or beyond all measure.
        """
        if len(content) != struct.calcsize(self._format) or content[0] != self.number:
            raise DeviceProtocolError(
                f"RTDE: a data package of {len(content)} bytes and another recipe than {self.number}"
            )
        numbers = iter(struct.unpack(self._format, content)[1:])
        found: dict[str, Value] = {}
        for name, kind in zip(self.names, self.types, strict=True):
            count = 1 if not kind.startswith("VECTOR") else int(kind[6])
            parts = tuple(next(numbers) for _ in range(count))
            if not all(isinstance(part, int) or abs(part) <= _LARGEST for part in parts):
                raise DeviceProtocolError(f"RTDE: {name} is {parts}, which no controller measures")
            found[name] = parts if kind.startswith("VECTOR") else parts[0]
        return found

    @property
    def _format(self) -> str:
        return ">B" + "".join(_FORMATS[kind] for kind in self.types)
