"""The layouts of an image, and the refusal of images that only look like one of them."""

from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from robot_drivers.errors import DeviceProtocolError

RawPixelFormat = Literal["mono8", "bayer_rggb8", "bayer_grbg8", "bayer_gbrg8", "bayer_bggr8"]
PixelFormat = Literal["mono8", "bgr8", "bayer_rggb8", "bayer_grbg8", "bayer_gbrg8", "bayer_bggr8"]
PIXEL_FORMATS: tuple[PixelFormat, ...] = get_args(PixelFormat)


def as_pixel_format(
    image: NDArray[np.integer | np.floating], pixel_format: PixelFormat, camera: str
) -> NDArray[np.uint8]:
    """Return an image as OpenCV decoded it in the layout of its format, (height, width) or (height, width, 3).

    No value is altered. Three equal channels count as grey levels.

    Raises
    ------
    DeviceProtocolError
        The image is empty, has another depth or number of channels, or colours where grey levels were asked.
    """
    channels = image.shape[2] if image.ndim == 3 else 1
    if (
        not image.size
        or image.dtype != np.uint8
        or channels not in ((3,) if pixel_format == "bgr8" else (1, 3))
    ):
        raise DeviceProtocolError(
            f"camera {camera}: {image.dtype} {image.shape} is no {pixel_format} image; choose another "
            "pixel_format, or set the camera to deliver this one"
        )
    pixels = np.asarray(image, dtype=np.uint8)
    if pixel_format == "bgr8" or pixels.ndim == 2:
        return pixels
    if not (pixels == pixels[:, :, :1]).all():
        raise DeviceProtocolError(
            f"camera {camera}: delivers colours where {pixel_format} was asked; use pixel_format bgr8, or switch "
            "the camera to raw images"
        )
    return np.asarray(cv2.extractChannel(pixels, 0), dtype=np.uint8)
