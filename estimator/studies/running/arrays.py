"""Arrays as text, so that a case can keep them where it keeps its numbers."""

import base64
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def as_text(array: FloatArray) -> str:
    """Return the digits of an array, without its shape: little-endian doubles in base 64."""
    return base64.b64encode(np.ascontiguousarray(array, dtype="<f8").tobytes()).decode("ascii")


def from_text(text: str, shape: Sequence[int]) -> FloatArray:
    """Return the array of that shape that :func:`as_text` wrote; one length may be −1."""
    return np.frombuffer(base64.b64decode(text), dtype="<f8").astype(np.float64).reshape(shape)
