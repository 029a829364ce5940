"""Images without loss: PNG where there is time for it, raw where there is not, a Bayer mosaic as its four planes.

The counts of a depth image are stored as grey levels of 16 bits.

Neighbours in a mosaic have different colours, which spoils the prediction of PNG: as it is, a mosaic of the
phantom shrinks to 1/1.4, with its four planes side by side to 1/2.3, like a mono image. Every viewer opens both.
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.files.png import grey_png, is_whole_png
from robot_drivers.protocols import Frame

PLANES = "planes"
DEPTH_FORMAT = "mono16"
"""Counts of depth: not those of ROS' 16UC1, which are mm."""

# as daq.files.png writes grey images
_COLOUR_PNG = (
    cv2.IMWRITE_PNG_COMPRESSION, 1,
    cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY,
    cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_UP,
)  # fmt: skip


Pixels = NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class EncodedImage:
    """An image as it is stored.

    Attributes
    ----------
    frame : that it is of
    pixel_format : of the pixels
    pixels : (height, width) or (height, width, channels)
    compression : how, in the words of ``CompressedImage``; None for raw
    data : what is stored
    """

    frame: Frame
    pixel_format: str
    pixels: Pixels
    compression: str | None
    data: memoryview


@dataclass(frozen=True, slots=True)
class Encoding:
    """How the images of a stream are stored where there is time for compression, and where there is none."""

    compressed: Callable[[Frame], EncodedImage]
    raw: Callable[[Frame], EncodedImage]


def compressed(frame: Frame) -> EncodedImage:
    """Compress an image; 1288 × 964 pixels of mono or mosaic take about 4 ms."""
    height, width = frame.image.shape[:2]
    if frame.pixel_format.startswith("bayer") and height % 2 == width % 2 == 0:
        return _image(frame, f"png compressed {PLANES}", _png(planes_of(frame.image)))
    return _image(frame, "png compressed", _png(frame.image))


def raw(frame: Frame) -> EncodedImage:
    """Take an image as it is."""
    return _image(frame, None, np.ascontiguousarray(frame.image).reshape(-1).data)


def compressed_depth(frame: Frame) -> EncodedImage:
    """Compress the depth of a frame that has one."""
    counts = _counts(frame)
    return EncodedImage(frame, DEPTH_FORMAT, counts, "png compressed", memoryview(grey_png(counts)))


def raw_depth(frame: Frame) -> EncodedImage:
    """Take the depth of a frame that has one as it is, the low byte first."""
    counts = _counts(frame)
    data = np.ascontiguousarray(counts, dtype="<u2").view(np.uint8).reshape(-1).data
    return EncodedImage(frame, DEPTH_FORMAT, counts, None, data)


IMAGES, DEPTH = Encoding(compressed, raw), Encoding(compressed_depth, raw_depth)
"""Of the two streams of a camera."""


def decoded(data: NDArray[np.uint8], compression: str) -> NDArray[np.uint8] | None:
    """Return the image that :func:`compressed` stored, None where the data are damaged."""
    pixels = _decoded(data, np.uint8)
    if pixels is None:
        return None
    image = pixels.astype(np.uint8, copy=False)
    return mosaic_of(image) if compression.endswith(PLANES) else image


def decoded_depth(data: NDArray[np.uint8]) -> NDArray[np.uint16] | None:
    """Return the counts that :func:`compressed_depth` stored, None where the data are damaged."""
    pixels = _decoded(data, np.uint16)
    return None if pixels is None else pixels.astype(np.uint16, copy=False)


def as_png(image: NDArray[np.uint8]) -> memoryview:
    """Return an image as every reader of PNG takes it: a mosaic as it is, not as its planes."""
    return _png(image)


def planes_of(mosaic: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Lay the four colour planes of a mosaic side by side, as in a window of four panes."""
    return np.block([[mosaic[0::2, 0::2], mosaic[0::2, 1::2]], [mosaic[1::2, 0::2], mosaic[1::2, 1::2]]])


def mosaic_of(planes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Undo :func:`planes_of`."""
    mosaic = np.empty_like(planes)
    height, width = planes.shape[0] // 2, planes.shape[1] // 2
    for row in (0, 1):
        for column in (0, 1):
            pane = planes[row * height : (row + 1) * height, column * width : (column + 1) * width]
            mosaic[row::2, column::2] = pane
    return mosaic


def _image(frame: Frame, compression: str | None, data: memoryview) -> EncodedImage:
    return EncodedImage(frame, frame.pixel_format, frame.image, compression, data)


def _counts(frame: Frame) -> NDArray[np.uint16]:
    if frame.depth is None:
        raise ValueError("the frame has no depth")
    return frame.depth.counts


def _decoded(data: NDArray[np.uint8], kind: type[np.generic]) -> NDArray[np.generic] | None:
    """Return the pixels of a PNG that are of this kind."""
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if is_whole_png(data.data) else None
    return image if image is not None and image.dtype == kind else None


def _png(image: NDArray[np.uint8]) -> memoryview:
    if image.ndim == 2:
        return memoryview(grey_png(image))
    return cv2.imencode(".png", image, _COLOUR_PNG)[1].data
