"""Depth in metres from what a depth camera counts."""

import numpy as np
from numpy.typing import NDArray

from robot_drivers.protocols import DepthScale, FloatArray


def depth_m(counts: NDArray[np.uint16], scale: DepthScale) -> FloatArray:
    """Return depth along the optical axis (...), m; NaN where it is not known."""
    depth = scale.scale_m * counts.astype(np.float64) + scale.offset_m
    return depth if scale.invalid is None else np.where(counts == scale.invalid, np.nan, depth)
