"""The frame information that Point Grey cameras write into the first pixels of an image.

Register FRAME_INFO (0x12F8) switches items on. Each takes the next four bytes, big-endian, from pixel (0, 0)
along the first row, in the order of :data:`ITEMS`; an item that is off takes no room. ``timestamp`` is the
cycle time of the IEEE 1394 bus: 7 bits of seconds, 13 bits of cycles (8000 in a second), 12 bits of offset
(3072 in a cycle). Some models put a frame counter in its lowest four bits, which is an error below 0.7 µs.
The information survives only where the pixels arrive unchanged: raw 8-bit images, neither demosaiced nor
compressed with loss.

Source: Flea3 technical reference, "Embedded Image Information" and FRAME_INFO: 12F8h.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from robot_drivers.errors import DeviceProtocolError

EmbeddedItem = Literal[
    "timestamp",
    "gain",
    "shutter",
    "brightness",
    "exposure",
    "white_balance",
    "frame_counter",
    "strobe_pattern",
    "gpio_pin_state",
    "roi_position",
]
ITEMS: tuple[EmbeddedItem, ...] = get_args(EmbeddedItem)

_BYTES_PER_ITEM = 4
_CYCLES_PER_SECOND = 8000
_OFFSETS_PER_CYCLE = 3072
_CYCLE_TIME_WRAP_S = 128.0
_COUNTER_WRAP = 1 << 32


@dataclass(frozen=True, slots=True)
class FrameInfo:
    """What one image tells of itself: frame counter (wraps at 2³²) and bus cycle time, s (wraps at 128 s)."""

    counter: int | None
    cycle_time_s: float | None


def cycle_time_s(quadlet: int) -> float:
    """Return the seconds of an IEEE 1394 cycle time; raises DeviceProtocolError where it cannot be one."""
    seconds, cycles, offset = quadlet >> 25, (quadlet >> 12) & 0x1FFF, quadlet & 0xFFF
    if cycles >= _CYCLES_PER_SECOND or offset >= _OFFSETS_PER_CYCLE:
        raise DeviceProtocolError(
            f"the first pixels hold {quadlet:#010x}, which is no bus cycle time: switch on the camera's "
            "embedded timestamp (FRAME_INFO 0x12F8), or drop it from embedded_info"
        )
    return seconds + (cycles + offset / _OFFSETS_PER_CYCLE) / _CYCLES_PER_SECOND


def read_frame_info(image: NDArray[np.uint8], items: Sequence[EmbeddedItem]) -> FrameInfo:
    """Read the items that are switched on from a raw image (height, width)."""
    quadlets = image[0, : _BYTES_PER_ITEM * len(items)].view(">u4").tolist()
    values = dict(zip(sorted(items, key=ITEMS.index), quadlets, strict=True))
    timestamp = values.get("timestamp")
    return FrameInfo(values.get("frame_counter"), None if timestamp is None else cycle_time_s(timestamp))


def blank_frame_info(image: NDArray[np.uint8], items: Sequence[EmbeddedItem]) -> None:
    """Set the pixels that carried information to zero."""
    image[0, : _BYTES_PER_ITEM * len(items)] = 0


class FrameSequence:
    """Follows the wrapping counters of consecutive images and counts the images that never came.

    Attributes
    ----------
    lost, duplicated, restarts : int
        Images that the camera counted and the host never saw; counters seen twice; counters that ran
        backwards.
    """

    def __init__(self) -> None:
        self.lost = 0
        self.duplicated = 0
        self.restarts = 0
        self._counter: int | None = None
        self._device_time_s: float | None = None
        self._host_time_ns = 0

    def unwrap(self, info: FrameInfo, host_time_ns: int) -> tuple[int | None, float | None]:
        """Return counter and device time, s, of the next image, carried beyond their wraps.

        The host clock (``host_time_ns``, at receipt) only decides how often the cycle time wrapped since the
        image before, so it may be off by a minute.
        """
        counter = None if info.counter is None else self._unwrap_counter(info.counter)
        time_s = None if info.cycle_time_s is None else self._unwrap_time(info.cycle_time_s, host_time_ns)
        self._counter, self._device_time_s, self._host_time_ns = counter, time_s, host_time_ns
        return counter, time_s

    def _unwrap_counter(self, counter: int) -> int:
        if self._counter is None:
            return counter
        step = (counter - self._counter) % _COUNTER_WRAP
        if step > _COUNTER_WRAP // 2:
            self.restarts += 1
            return counter
        if step == 0:
            self.duplicated += 1
        else:
            self.lost += step - 1
        return self._counter + step

    def _unwrap_time(self, cycle_time_s: float, host_time_ns: int) -> float:
        if self._device_time_s is None:
            return cycle_time_s
        expected_s = self._device_time_s + (host_time_ns - self._host_time_ns) * 1e-9
        return cycle_time_s + _CYCLE_TIME_WRAP_S * round((expected_s - cycle_time_s) / _CYCLE_TIME_WRAP_S)
