"""Fuzz targets: what cameras embed in their images, how it counts, and the layouts of images.

The containers of images and video are read by OpenCV, not here.
"""

from random import Random
from typing import get_args

import numpy as np

from robot_drivers.cameras.embedded_info import (
    ITEMS,
    EmbeddedItem,
    FrameInfo,
    FrameSequence,
    read_frame_info,
)
from robot_drivers.cameras.pixel_formats import PixelFormat, as_pixel_format
from robot_drivers.fuzzing.mutations import overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree

_INFO = bytes.fromhex(
    "2a3e8bff 00000000 00000000 00000000 00000000 00000000 0000002a 00000000 00000000 00000000"
)


def _embedded(random: Random) -> tuple[bytes, tuple[EmbeddedItem, ...]]:
    items = random.sample(ITEMS, random.randrange(len(ITEMS) + 1))
    return overwritten(random, [_INFO, b"\xff" * 40, bytes(40)]), tuple(items)


def _check_embedded(case: tuple[bytes, tuple[EmbeddedItem, ...]]) -> bool:
    """Read the quadlets again, by their place among those that are on."""
    row, items = case
    info = read_frame_info(np.frombuffer(row, np.uint8).reshape(1, -1), items)
    on = [item for item in ITEMS if item in items]
    said = {item: int.from_bytes(row[4 * place : 4 * place + 4], "big") for place, item in enumerate(on)}
    agree(info.counter, said.get("frame_counter"), "frame counter")
    if info.cycle_time_s is not None:
        bits = f"{said['timestamp']:032b}"
        seconds, cycles, offset = (int(part, 2) for part in (bits[:7], bits[7:20], bits[20:]))
        agree(cycles < 8000 and offset < 3072, True, "a cycle time that can be one")
        ticks = (seconds * 8000 + cycles) * 3072 + offset
        if abs(info.cycle_time_s - ticks / 24_576_000) > 1e-9:
            raise WrongValueError(f"{bits} is not {info.cycle_time_s} s")
    return info != FrameInfo(None, None)


def _exposures(random: Random) -> list[tuple[int, int]]:
    """Return (counter on the wire, true exposure) of the images that arrive."""
    first = random.choice((0, 2**32 - 5, random.randrange(2**32)))
    loss, doubling = random.choice((0.0, 0.1)), random.choice((0.0, 0.05))
    arriving = []
    for exposure in range(random.randrange(1, 40)):
        if random.random() >= loss:
            arriving += [((first + exposure) % 2**32, exposure)] * (1 + (random.random() < doubling))
    return arriving


def _check_exposures(arriving: list[tuple[int, int]]) -> bool:
    """Unwrapped counters and times differ as exposures do, and what is missing is counted."""
    sequence, offsets = FrameSequence(), set()
    for counter, exposure in arriving:
        cycle_time_s = (exposure * 50.0) % 128.0
        unwrapped, time_s = sequence.unwrap(FrameInfo(counter, cycle_time_s), int(exposure * 50e9) + 10**9)
        if unwrapped is None or time_s is None:
            raise WrongValueError("a counter and a time came in, none came out")
        offsets.add((unwrapped - exposure, round(time_s - exposure * 50.0)))
    agree(len(offsets) <= 1, True, f"offsets {offsets} are one")
    exposures = [exposure for _, exposure in arriving]
    span = max(exposures) - min(exposures) + 1 if exposures else 0
    agree(sequence.lost, span - len(set(exposures)), "lost images")
    agree(sequence.duplicated, len(exposures) - len(set(exposures)), "doubled images")
    return bool(arriving)


def _image(random: Random) -> tuple[bytes, tuple[int, ...], str, PixelFormat]:
    shape = random.choice(((4, 6), (4, 6, 1), (4, 6, 3), (4, 6, 4), (0, 6), (4, 0, 3)))
    depth = random.choice(("u1", "u1", "u1", "u2", "f4"))
    size = int(np.prod(shape)) * np.dtype(depth).itemsize
    grey = bytes(value for value in random.randbytes(size // 3 + 1) for _ in range(3))[:size]
    content = grey if random.random() < 0.5 else random.randbytes(size)
    return content, shape, depth, random.choice(get_args(PixelFormat))


def _check_image(case: tuple[bytes, tuple[int, ...], str, PixelFormat]) -> bool:
    """An image that is taken has the shape of its format and each value of the one that came."""
    content, shape, depth, pixel_format = case
    came = np.frombuffer(content, depth).reshape(shape)
    taken = as_pixel_format(came, pixel_format, "fuzzed")
    colour = pixel_format == "bgr8"
    agree(taken.shape, (*shape[:2], 3) if colour else shape[:2], "shape")
    same = (came == (taken if colour or came.ndim == 2 else taken[..., np.newaxis])).all()
    agree((bool(same), taken.dtype == np.uint8, depth), (True, True, "u1"), "values")
    return True


TARGETS = (
    Target("camera-embedded-info", "quadlets read by their bits", _embedded, _check_embedded),
    Target("camera-frame-sequence", "each image carries its true exposure", _exposures, _check_exposures),
    Target("camera-pixel-format", "each value is the one that came", _image, _check_image),
)
