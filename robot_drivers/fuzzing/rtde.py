"""Fuzz targets: the packages of a Universal Robots controller, and the data in them."""

import math
import struct
from random import Random

from robot_drivers.errors import DeviceProtocolError
from robot_drivers.fuzzing.mutations import mutated, overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree
from robot_drivers.universal_robots.robot.registers import OUTPUTS, Told
from robot_drivers.universal_robots.rtde.packages import (
    Kind,
    Package,
    Recipe,
    accepted,
    controller_version,
    take_package,
    text_of,
)

_TYPES = b"DOUBLE,VECTOR6D,VECTOR6D,VECTOR6D,INT32,INT32,UINT32,INT32,INT32,INT32" + 6 * b",DOUBLE"
_RECIPE = Recipe.of_answer(Package(Kind.OUTPUTS, b"\x01" + _TYPES), OUTPUTS)
_DATA = struct.pack(
    ">Bd6d6d6d2iI3i6d",
    *(1, 12.002),
    *(0.1, -1.2, 1.5, -0.7, 0.4, 0.9),
    *(-0.486, -0.133, 0.42, 2.22, 2.22, 0.0),
    *(0.0,) * 6,
    *(7, 1, 2, 4101, 1, 99),
    *(0.0, 0.0, 0.1, 0.0, 0.0, 0.0),
)
_TEXT = b"\x05hello\x04RTDE\x03"
_STREAM = (
    b"\x00\x04V\x01",
    b"\x00\x13v" + struct.pack(">4I", 5, 14, 6, 1),
    bytes((0, 3 + len(_TEXT))) + b"M" + _TEXT,
    struct.pack(">HB", 3 + len(_DATA), ord("U")) + _DATA,
    struct.pack(">HB", 4 + len(_TYPES), ord("O")) + b"\x01" + _TYPES,
    b"\x00\x04S\x01",
)


def _stream(random: Random) -> bytes:
    return mutated(random, [b"".join(random.choices(_STREAM, k=3)) for _ in range(2)])


def _check_stream(received: bytes) -> bool:
    """Packages tile what was received, by their own lengths, and their contents say what their bytes say."""
    left, place = bytearray(received), 0
    while (package := take_package(left)) is not None:
        size = int.from_bytes(received[place : place + 2], "big")
        agree(
            (package.kind, package.content),
            (received[place + 2], received[place + 3 : place + size]),
            "package",
        )
        place += size
        _check_content(package)
    agree(bytes(left), received[place:], "what is left")
    return place > 0


def _check_content(package: Package) -> None:
    content = package.content
    try:
        match package.kind:
            case Kind.PROTOCOL | Kind.START | Kind.PAUSE:
                agree(accepted(package), content == b"\x01", "verdict")
            case Kind.CONTROLLER:
                numbers = [int.from_bytes(content[place : place + 4], "big") for place in range(0, 16, 4)]
                agree(controller_version(package), ".".join(map(str, numbers)), "version")
            case Kind.TEXT:
                agree(len(text_of(package)), len(content) - 1, "length of a text")
            case Kind.OUTPUTS:
                Recipe.of_answer(package, OUTPUTS)
    except DeviceProtocolError:
        return  # a package that is whole may hold what is refused


def _data(random: Random) -> bytes:
    return (mutated if random.random() < 0.3 else overwritten)(random, (_DATA,))


def _check_data(content: bytes) -> bool:
    """Every number is finite, and that of its eight or four bytes."""
    values = _RECIPE.decode(content)
    numbers = struct.unpack(">Bd6d6d6d2iI3i6d", content)
    agree(values["timestamp"], numbers[1], "clock")
    agree(values["actual_q"], numbers[2:8], "joints")
    told = Told.by(values)
    agree(told.T_base_tool.position, numbers[8:11], "position")
    if not all(math.isfinite(part) for part in told.T_base_tool.quaternion_wxyz):
        raise WrongValueError("a rotation that is no finite number")
    agree(
        (told.version, told.doing, told.beat), (numbers[23] * (numbers[22] == 2), *numbers[24:26]), "program"
    )
    return True


TARGETS = (
    Target("rtde-stream", "packages tile the bytes by their own lengths", _stream, _check_stream),
    Target("rtde-data", "each number is that of its own bytes, and finite", _data, _check_data),
)
