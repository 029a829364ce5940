"""How well a device's clock is known on the host's, while it runs: for a lamp, not for the analysis.

A message can be late, but never early, so the earliest ones tell the clock (:mod:`daq.timing.envelope`). Each quarter
of the last seconds has its own earliest one; how far these lie apart, beyond a straight line, is how far the relation
of the clocks can be off.
"""

import math
from collections import deque

import numpy as np

from daq.timing.envelope import lower_envelope

_LAST_S = 20.0
_PERIOD_S = 0.02
_QUARTERS = 4
_FEWEST = 5  # in each quarter


class ClockWatch:
    """Keeps pairs of stamps of the last 20 s, at most 50 a second."""

    def __init__(self) -> None:
        self._stamps: deque[tuple[float, float]] = deque(maxlen=round(_LAST_S / _PERIOD_S))
        self._origin: tuple[float, int] | None = None

    def add(self, device_time_s: float, host_time_ns: int) -> None:
        """Take the stamps of one sample; a device clock that goes back begins anew."""
        if self._origin is None or device_time_s < self._origin[0]:
            self._origin = (device_time_s, host_time_ns)
            self._stamps.clear()
        device_s, host_s = device_time_s - self._origin[0], (host_time_ns - self._origin[1]) * 1e-9
        if self._stamps and device_s < self._stamps[-1][0]:
            self._stamps.clear()
        if not self._stamps or device_s - self._stamps[-1][0] >= _PERIOD_S:
            self._stamps.append((device_s, host_s))

    def uncertainty_s(self) -> float:
        """Return half the spread of the quarters' earliest messages about one line, s; NaN with too few."""
        if len(self._stamps) < _QUARTERS * _FEWEST:
            return math.nan
        device_s, host_s = np.array(self._stamps).T
        device_s, late_s = device_s - device_s.mean(), host_s - device_s
        late_s = late_s - late_s.mean()
        intercept, slope = lower_envelope(device_s, late_s)
        left_s = late_s - slope * device_s - intercept
        earliest = [float(quarter.min()) for quarter in np.array_split(left_s, _QUARTERS)]
        return 0.5 * (max(earliest) - min(earliest))
