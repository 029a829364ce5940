"""How long the guard takes, as a tally of bounded size."""

import math

import numpy as np

_SMALLEST_S = 1e-5
_STEPS_PER_DECADE = 40
_DECADES = 7


class LatencyTally:
    """Counts durations in bins 6 % wide, from 10 µs to 100 s; one writer, any reader."""

    def __init__(self) -> None:
        self._counts = np.zeros(_DECADES * _STEPS_PER_DECADE + 1, dtype=np.int64)
        self.longest_s = 0.0

    def add(self, duration_s: float) -> None:
        """Count one duration."""
        place = math.log10(max(duration_s, _SMALLEST_S) / _SMALLEST_S) * _STEPS_PER_DECADE
        self._counts[min(int(place), len(self._counts) - 1)] += 1
        self.longest_s = max(self.longest_s, duration_s)

    @property
    def count(self) -> int:
        """Durations so far."""
        return int(self._counts.sum())

    def quantile_s(self, share: float) -> float:
        """Return the upper end of the bin below which a share of the durations lies; NaN for none."""
        if self.count == 0:
            return math.nan
        place = int(np.searchsorted(np.cumsum(self._counts), share * self.count))
        return min(_SMALLEST_S * 10 ** ((place + 1) / _STEPS_PER_DECADE), self.longest_s)
