"""What emulated force sensors feel."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from robot_drivers.protocols import FloatArray

WrenchSource = Callable[[float], NDArray[np.float64]]
"""Device time in s to the true wrench in the sensor frame, (6,), N and N·m; called from the emulator's threads."""


class InterpolatedSource:
    """Asks a wrench source once per burst, never ahead of time, and interpolates in between."""

    def __init__(self, source: WrenchSource, burst_s: float) -> None:
        self._source = source
        self._burst_s = burst_s
        self._last_time_s = -np.inf
        self._last_wrench = np.zeros(6)

    def wrenches(self, times_s: FloatArray) -> FloatArray:
        """Return the wrench at ascending times (n,), n > 0, as (n, 6), N and N·m."""
        begin, end = float(times_s[0]), float(times_s[-1])
        if not 0 < begin - self._last_time_s <= self._burst_s:
            self._last_time_s, self._last_wrench = begin, self._source(begin)
        pieces = max(1, int(np.ceil((end - self._last_time_s) / self._burst_s)))
        knots = np.linspace(self._last_time_s, end, pieces + 1)
        wrenches = np.array([self._last_wrench, *(self._source(knot) for knot in knots[1:].tolist())])
        self._last_time_s, self._last_wrench = end, wrenches[-1]
        return np.stack([np.interp(times_s, knots, axis) for axis in wrenches.T], axis=1)
