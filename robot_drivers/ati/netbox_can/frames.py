"""The frames of a Net F/T box's native "CAN Bus" protocol. Everything is little-endian, two's complement.

Requests are one byte under the base identifier; the answers follow under the identifiers after it. Forces and torques
alternate. Source: ATI 9620-05-Net FT, pages 89 and 90. Of the long answer the manual pages at hand tell only that it
is four messages of 32-bit values; its order follows that of the short one and is a setting.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from robot_drivers.ati.can.link import Request

Field = Literal["fx", "fy", "fz", "tx", "ty", "tz", "status", "sample"]
FIELDS: tuple[Field, ...] = get_args(Field)

SHORT_ORDER: tuple[Field, ...] = ("fx", "tx", "fy", "ty", "fz", "tz", "status", "sample")
"""The fields of a short answer, four in each message."""

LONG_ORDER = SHORT_ORDER
"""The fields of a long answer, two in each message: by analogy."""

SHORT_REQUEST = 0x02
BIAS = 0x04
LONG_SAMPLES = 1 << 32
SHORT_SAMPLES = 1 << 16
"""How many sample numbers there are before they begin again."""

_AXES: tuple[Field, ...] = FIELDS[:6]


@dataclass(frozen=True, slots=True)
class Reading:
    """One answer: counts of Fx Fy Fz Tx Ty Tz as on the wire, status word and sample number without sign."""

    counts: tuple[int, ...]
    status: int
    sample: int


def long_request(base: int, code: int) -> Request:
    """Return the request for 32-bit counts."""
    return Request("REQUEST LONG", base, bytes([code]), tuple((base + n, 8) for n in (1, 2, 3, 4)))


def short_request(base: int) -> Request:
    """Return the request for 16-bit counts."""
    return Request("REQUEST SHORT", base, bytes([SHORT_REQUEST]), ((base + 5, 8), (base + 6, 8)))


def command(base: int, code: int) -> Request:
    """Return a request without an answer: bias, or clearing the threshold latch."""
    return Request("COMMAND", base, bytes([code]))


def decode_long(frames: Sequence[bytes], order: Sequence[Field]) -> Reading:
    """Decode the four messages of a long answer, whose fields come in this order."""
    return _reading(dict(zip(order, struct.unpack("<8i", b"".join(frames)), strict=True)), LONG_SAMPLES)


def decode_short(frames: Sequence[bytes]) -> Reading:
    """Decode the two messages of a short answer."""
    return _reading(
        dict(zip(SHORT_ORDER, struct.unpack("<8h", b"".join(frames)), strict=True)), SHORT_SAMPLES
    )


def _reading(values: dict[Field, int], span: int) -> Reading:
    counts = tuple(values[axis] for axis in _AXES)
    return Reading(counts, values["status"] % span, values["sample"] % span)
