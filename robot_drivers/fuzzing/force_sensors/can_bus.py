"""Fuzz targets: devices on a CAN bus - exchanges with a NETCANOEM board, and what the frames hold."""

import struct
from collections.abc import Iterable
from random import Random

import can
import numpy as np

from robot_drivers.ati.can.link import CanLink
from robot_drivers.ati.netbox_can.frames import LONG_ORDER, decode_long, decode_short
from robot_drivers.ati.netcanoem.frames import (
    DEFAULT_BASE,
    Opcode,
    decode_firmware,
    decode_gages,
    decode_scaling,
    decode_serial,
    request,
)
from robot_drivers.errors import DeviceProtocolError, DeviceTimeoutError
from robot_drivers.fuzzing.mutations import overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree

Frame = tuple[int, bytes, bool]
"""Identifier, data, whether the identifier is an extended one."""

_EVEN, _ODD = 0x200, 0x201
_ODD_REST = struct.pack(">2h", 8, -8)


class _ReplayedBus(can.BusABC):
    """A bus on which these frames come after the first request."""

    channel_info = "replayed"

    def __init__(self, frames: Iterable[Frame]) -> None:
        self._frames = [
            can.Message(arbitration_id=identifier, data=data, is_extended_id=extended)
            for identifier, data, extended in frames
        ]
        self._asked = False
        self._is_shutdown = True  # there is nothing to shut down

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Take a request."""
        self._asked = True

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next frame, None for silence."""
        return self._frames.pop(0) if self._asked and self._frames else None


def _gage_frames(random: Random) -> list[Frame]:
    """Return the answers to one or more requests; both frames of a sample carry its number."""
    frames: list[Frame] = []
    for number in range(random.choice((1, 1, 2, 3))):
        frames.append((_EVEN, struct.pack(">H3h", 0, number, 7, -7), False))
        frames.append((_ODD, struct.pack(">h", number) + _ODD_REST, False))
    return _bad_bus(random, frames)


def _bad_bus(random: Random, frames: list[Frame]) -> list[Frame]:
    """Lose, double, cut and mix frames; a CAN bus damages none and keeps their order."""
    arriving: list[Frame] = []
    lost = random.randrange(len(frames)) if random.random() < 0.5 else None
    for place, (identifier, data, extended) in enumerate(frames):
        if place == lost:
            continue
        if random.random() < 0.1:
            stranger = random.choice((identifier, random.randrange(0x800)))
            arriving.append((stranger, random.randbytes(random.randrange(9)), random.random() < 0.8))
        cut = random.random() < 0.05 and len(data) > 0
        arriving.append((identifier, data[: random.randrange(len(data))] if cut else data, extended))
        if random.random() < 0.05:
            arriving.append(arriving[-1])
    return arriving


def _check_gage_frames(frames: list[Frame]) -> bool:
    """Both frames of a sample belong together, and each gage is what its two bytes say."""
    link = CanLink(_ReplayedBus(frames), "replayed board", timeout_s=0.01)
    even, odd = link.ask(request(DEFAULT_BASE, Opcode.GAGES)).frames
    for identifier, data in ((_EVEN, even), (_ODD, odd)):
        if (identifier, data, False) not in frames:
            raise WrongValueError(f"{data.hex()} was never sent under {identifier:#x}")
    status, gages = decode_gages(even, odd)
    said = [
        int.from_bytes(data[i : i + 2], "big", signed=True) for data in (even[2:], odd) for i in (0, 2, 4)
    ]
    agree((status, [gages[i] for i in (0, 2, 4, 1, 3, 5)]), (int.from_bytes(even[:2], "big"), said), "gages")
    forged = odd[2:] != _ODD_REST  # under the board's own identifier, by another node: nothing can tell
    if gages[0] != gages[1] and not forged:
        raise WrongValueError(f"the even gages of sample {gages[0]} came with the odd ones of {gages[1]}")
    return True


def _description(random: Random) -> tuple[bytes, bytes, bytes, bytes]:
    counts = overwritten(random, [bytes.fromhex("000F4240 000F4240")])
    units = overwritten(random, [b"\x02\x03"])
    serial = overwritten(random, [b"FT33206\0"])
    return counts, units, serial, overwritten(random, [b"\x03\x08\x00\x1b"])


def _check_description(answers: tuple[bytes, bytes, bytes, bytes]) -> bool:
    counts, units, serial, firmware = answers
    major, minor, build = decode_firmware(firmware)
    agree(struct.pack(">BBH", major, minor, build), firmware, "firmware")
    text = decode_serial(serial)
    agree(all(ord(character) in (*serial, 0xFFFD) for character in text), True, "serial number")
    scaling = decode_scaling(counts, units)
    told = struct.pack(">II", int(scaling.counts_per_force), int(scaling.counts_per_torque))
    agree(told, counts, "counts per unit")
    if not ((scaling.si_per_count > 0).all() and np.isfinite(scaling.si_per_count).all()):
        raise WrongValueError(f"scaling {scaling} was taken for good")
    return True


def _box_frames(random: Random) -> list[bytes]:
    return [overwritten(random, [bytes(range(8)), b"\x0f\xcf\xda\xfd\xff\xff\xff\x7f"]) for _ in range(4)]


def _check_box_frames(frames: list[bytes]) -> bool:
    """Read the fields again, force beside torque, each by its own bytes."""
    for reading, width in ((decode_long(frames, LONG_ORDER), 4), (decode_short(frames[:2]), 2)):
        content = b"".join(frames)
        pieces = [content[k * width : (k + 1) * width] for k in range(8)]
        said = [int.from_bytes(piece, "little", signed=True) for piece in pieces[:6]]
        agree(reading.counts, tuple(said[::2] + said[1::2]), "counts")
        numbers = tuple(int.from_bytes(piece, "little") for piece in pieces[6:])
        agree((reading.status, reading.sample), numbers, "status and sample number")
    return True


TARGETS = (
    Target(
        "netcanoem-exchange",
        "both frames of a sample carry its number",
        _gage_frames,
        _check_gage_frames,
        (DeviceProtocolError, DeviceTimeoutError),
    ),
    Target("netbox-can", "each field by its own bytes", _box_frames, _check_box_frames),
    Target("netcanoem-description", "encoded again, the same bytes", _description, _check_description),
)
