"""The line under a cloud of (device, host) points: a message can be late, but never early.

Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements" (INFOCOM 1999): of
all lines that lie below every point, the one with the smallest sum of distances. That line runs through the edge of
the lower convex hull above the mean of the abscissae, which is found here without building the hull.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def lower_envelope(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return (intercept at x = 0, slope) of the line below the points.

    Parameters
    ----------
    x, y : (n,) with n >= 2 and x not all the same; best near zero, to keep digits
    """
    centre = x.mean()
    before = x <= centre
    left = int(np.argmin(np.where(before, y, np.inf)))
    right = int(np.argmin(np.where(before, np.inf, y)))
    while True:
        slope = (y[right] - y[left]) / (x[right] - x[left])
        height = y - slope * x
        lowest = int(np.argmin(height))
        # the two ends differ from the line by rounding alone
        if height[lowest] >= min(height[left], height[right]):
            return float(height[lowest]), float(slope)
        if before[lowest]:
            left = lowest
        else:
            right = lowest
