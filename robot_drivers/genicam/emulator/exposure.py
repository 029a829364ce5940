"""One exposure of the emulated camera: when it is, what is asked of it, and the block that its images make."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.genicam.emulator.description import COMPONENTS
from robot_drivers.genicam.emulator.settings import PIXEL_FORMATS, GigECameraSettings
from robot_drivers.genicam.emulator.stream import Block, MultipartBlock, PartOfBlock

ImageSource = Callable[[float], NDArray[np.uint8]]
"""Time in s since the camera was built to what it sees, (height, width); called from its thread."""

DepthSource = Callable[[float], NDArray[np.uint16] | NDArray[np.float32]]
"""The same to the counts of depth."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """An exposure that has begun.

    Attributes
    ----------
    number : of its block
    due_ns : host time
    stamp : ticks of the camera's clock
    in_parts : whether image and depth are sent as parts of one block
    with_chunk : whether the time is appended as a chunk
    extended_ids : whether its number has 64 bits
    booted_ns : when the camera that takes it was switched on
    """

    number: int
    due_ns: int
    stamp: int
    in_parts: bool
    with_chunk: bool
    extended_ids: bool
    booted_ns: int

    def block(
        self, time_s: float, settings: GigECameraSettings, source: ImageSource, depth: DepthSource | None
    ) -> Block | MultipartBlock:
        """Return what is sent: the image that is seen at ``time_s``, or with it that of depth."""
        size = (settings.width, settings.height)
        image_format = PIXEL_FORMATS[settings.pixel_format]
        image = source(time_s).tobytes().ljust(settings.image_bytes, b"\0")
        if not self.in_parts:
            chunk = self.stamp if self.with_chunk else None
            return Block(self.number, self.stamp, image_format, *size, image, chunk)
        parts = [PartOfBlock(COMPONENTS["Intensity"], image_format, *size, image)]
        if settings.depth is not None and depth is not None:
            counts = depth(time_s)
            content = counts.astype(counts.dtype.newbyteorder("<")).tobytes()
            depth_format = PIXEL_FORMATS[settings.depth.depth_format]
            parts.append(PartOfBlock(COMPONENTS["Range"], depth_format, *size, content))
        return MultipartBlock(self.number, self.stamp, tuple(parts), self.extended_ids)
