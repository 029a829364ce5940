"""The line under a cloud of (device, host) points: a message can be late, but never early.

Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements" (INFOCOM 1999): of
all lines that lie below every point, the one with the smallest sum of distances. That line runs through the edge of
the lower convex hull above the mean of the abscissae, which is found here without building the hull. It is the most
likely one where the delays are exponentially distributed (Hajek).
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
    slope = _hull_slope(x, y, float(x.mean()))
    return float((y - slope * x).min()), slope


def lower_envelope_near(x: FloatArray, y: FloatArray, usual: float, spread: float) -> tuple[float, float]:
    """Return (intercept at x = 0, slope) of the line below the points whose slope is likely to be the usual one.

    It is the most likely line for exponential delays and a slope with the density exp(-|slope - usual| / spread) / 2
    spread: many prompt points tell the slope by themselves, and few late ones leave it as it usually is. The prior
    moves the abscissa at which the hull's edge is taken, so the usual slope is kept as long as it lies between those
    of the hull's edges at both ends of that reach.

    Parameters
    ----------
    x, y : as for :func:`lower_envelope`
    """
    free, slope = lower_envelope(x, y)
    delay = float((y - slope * x - free).mean())
    reach, centre = delay / (len(x) * spread), float(x.mean())
    lowest = _hull_slope(x, y, centre - reach) if centre - reach >= x.min() else -np.inf
    highest = _hull_slope(x, y, centre + reach) if centre + reach < x.max() else np.inf
    slope = min(max(usual, lowest), highest)
    return float((y - slope * x).min()), slope


def _hull_slope(x: FloatArray, y: FloatArray, at: float) -> float:
    """Return the slope of the edge of the lower convex hull above an abscissa, x.min() <= at < x.max()."""
    before = x <= at
    left = int(np.argmin(np.where(before, y, np.inf)))
    right = int(np.argmin(np.where(before, np.inf, y)))
    while True:
        slope = float((y[right] - y[left]) / (x[right] - x[left]))
        height = y - slope * x
        lowest = int(np.argmin(height))
        # the two ends differ from the line by rounding alone
        if height[lowest] >= min(height[left], height[right]):
            return slope
        if before[lowest]:
            left = lowest
        else:
            right = lowest
