"""Images without loss: PNG where there is time for it, raw where there is not, a Bayer mosaic as its four planes.

Neighbours in a mosaic have different colours, which spoils the prediction of PNG: as it is, a mosaic of the
phantom shrinks to 1/1.4, with its four planes side by side to 1/2.3, like a mono image. Every viewer opens both.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.files.png import grey_png, is_whole_png
from robot_drivers.protocols import Frame

PLANES = "planes"
# as daq.files.png writes grey images
_COLOUR_PNG = (
    cv2.IMWRITE_PNG_COMPRESSION, 1,
    cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY,
    cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_UP,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class EncodedImage:
    """An image as it is stored; ``compression`` says how in the words of ``CompressedImage``, None for raw."""

    frame: Frame
    compression: str | None
    data: memoryview


def compressed(frame: Frame) -> EncodedImage:
    """Compress an image; 1288 × 964 pixels of mono or mosaic take about 4 ms."""
    height, width = frame.image.shape[:2]
    if frame.pixel_format.startswith("bayer") and height % 2 == width % 2 == 0:
        return EncodedImage(frame, f"png compressed {PLANES}", _png(planes_of(frame.image)))
    return EncodedImage(frame, "png compressed", _png(frame.image))


def raw(frame: Frame) -> EncodedImage:
    """Take an image as it is."""
    return EncodedImage(frame, None, np.ascontiguousarray(frame.image).reshape(-1).data)


def decoded(data: NDArray[np.uint8], compression: str) -> NDArray[np.uint8] | None:
    """Return the image that :func:`compressed` stored, None where the data are damaged."""
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if is_whole_png(data.data) else None
    if image is None:
        return None
    pixels = np.asarray(image, dtype=np.uint8)
    return mosaic_of(pixels) if compression.endswith(PLANES) else pixels


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


def _png(image: NDArray[np.uint8]) -> memoryview:
    if image.ndim == 2:
        return memoryview(grey_png(image))
    return cv2.imencode(".png", image, _COLOUR_PNG)[1].data
