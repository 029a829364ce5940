"""Fuzz target: a block of GigE Vision in parts, of which a leader tells what it likes.

Datagrams and their order are Aravis', which is not fuzzed here.
"""

import struct
from collections.abc import Iterator
from random import Random

import numpy as np

from robot_drivers.fuzzing.mutations import mutated, overwritten
from robot_drivers.fuzzing.target import Target, agree
from robot_drivers.genicam.parts import Part, image_and_depth

_WIDTH, _HEIGHT = 5, 3
_PIXELS = _WIDTH * _HEIGHT
_PART = struct.Struct(">HIIII")
_MONO8, _C16, _CONFIDENCE8 = 0x01080001, 0x011000B8, 0x010800C6
_IMAGE = _PART.pack(1, _MONO8, _WIDTH, _HEIGHT, _PIXELS)
_DEPTH = _PART.pack(4, _C16, _WIDTH, _HEIGHT, 2 * _PIXELS)
_CONFIDENCE = _PART.pack(6, _CONFIDENCE8, _WIDTH, _HEIGHT, _PIXELS)
_LEADERS = (
    _IMAGE + _DEPTH,
    _DEPTH + _IMAGE,
    _DEPTH + _CONFIDENCE + _IMAGE,
    _IMAGE + _IMAGE + _DEPTH,
    _IMAGE,
    _DEPTH,
)


def _block(random: Random) -> tuple[bytes, bytes]:
    """Return what a leader tells, and the bytes of the block."""
    leader = random.choice(_LEADERS) if random.random() < 0.5 else overwritten(random, _LEADERS)
    content = random.randbytes(4 * _PIXELS)
    return leader, content if random.random() < 0.5 else mutated(random, (content,))


def _told(leader: bytes) -> Iterator[tuple[int, ...]]:
    return _PART.iter_unpack(leader[: len(leader) // _PART.size * _PART.size])


def _check_block(case: tuple[bytes, bytes]) -> bool:
    """Pick every pixel out of the block again, by its place."""
    leader, content = case
    parts = [Part(*told) for told in _told(leader)]
    image, counts = image_and_depth(np.frombuffer(content, np.uint8), parts, (_WIDTH, _HEIGHT))
    begins, place = {}, 0
    for component, pixel_format, width, height, size in _told(leader):
        agree(component in begins, False, "a component that was there before")
        begins[component] = place
        place += size
        if component in (1, 4):
            agree((width, height), (_WIDTH, _HEIGHT), "size")
            agree(pixel_format >> 16 & 0xFF, 8 if component == 1 else 16, "bits of a pixel")
    for number in range(_PIXELS):
        row, column = divmod(number, _WIDTH)
        low = begins[4] + 2 * number
        agree(int(image[row, column]), content[begins[1] + number], "grey level")
        agree(int(counts[row, column]), content[low] + 256 * content[low + 1], "count of depth")
    return True


TARGETS = (Target("gige-parts", "each pixel picked out by its place", _block, _check_block),)
