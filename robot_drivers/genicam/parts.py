"""Images that come as parts of one block of GigE Vision: that of intensity, and that of depth, found and decoded.

Sources: GenICam Standard Features Naming Convention 2.7, ComponentIDValue; Pixel Format Naming Convention 2.4:
Coord3D_C16 is one number of 16 bits a pixel, on GigE Vision the low byte first.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.errors import DeviceProtocolError

INTENSITY, RANGE = 1, 4
"""Ids of the components."""

_EIGHT_BITS = (0x01080001, *range(0x01080008, 0x0108000C))
_COORD3D_C16 = 0x011000B8


@dataclass(frozen=True, slots=True)
class Part:
    """What a block tells of one of its parts.

    Attributes
    ----------
    component : id
    pixel_format : number of the Pixel Format Naming Convention
    width, height : px
    size : bytes
    """

    component: int
    pixel_format: int
    width: int
    height: int
    size: int


def image_and_depth(
    content: NDArray[np.uint8], parts: Sequence[Part], size: tuple[int, int]
) -> tuple[NDArray[np.uint8], NDArray[np.uint16]]:
    """Return image and counts of depth, both (height, width), from the bytes of a block (n,), as copies.

    What a block tells of its parts is not trusted: Aravis gives it unchecked.

    Parameters
    ----------
    parts : in the order in which they lie in the block
    size : width and height that both are to have, px

    Raises
    ------
    DeviceProtocolError
        A part is missing or doubled, of another size or format, or reaches beyond the block.
    """
    image = _only(content, parts, INTENSITY, "Intensity")
    depth = _only(content, parts, RANGE, "Range")
    width, height = size
    pixels = _pixels(*image, size, _EIGHT_BITS, 1)
    counts = _pixels(*depth, size, (_COORD3D_C16,), 2).view("<u2").astype(np.uint16)
    return pixels.reshape(height, width).copy(), counts.reshape(height, width)


def _only(
    content: NDArray[np.uint8], parts: Sequence[Part], component: int, name: str
) -> tuple[Part, NDArray[np.uint8]]:
    """Return the only part of a component, and its bytes."""
    places = [place for place, part in enumerate(parts) if part.component == component]
    if len(places) != 1:
        raise DeviceProtocolError(f"a block of {len(parts)} parts has {len(places)} of the component {name}")
    part, begin = parts[places[0]], sum(part.size for part in parts[: places[0]])
    if begin + part.size > content.size:
        raise DeviceProtocolError(
            f"the part {name} ends at byte {begin + part.size} of a block of {content.size}"
        )
    return part, content[begin : begin + part.size]


def _pixels(
    part: Part, content: NDArray[np.uint8], size: tuple[int, int], formats: Sequence[int], each: int
) -> NDArray[np.uint8]:
    """Return the bytes of a part whose pixels are ``each`` bytes long."""
    if part.pixel_format not in formats or (part.width, part.height) != size:
        raise DeviceProtocolError(
            f"a part of {part.width}x{part.height} px of the format {part.pixel_format:#010x}, where "
            f"{size[0]}x{size[1]} px of {formats[0]:#010x} were told"
        )
    if part.size != part.width * part.height * each:
        raise DeviceProtocolError(f"a part of {part.width}x{part.height} px has {part.size} bytes")
    return content
