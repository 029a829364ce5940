"""Counters and times of frames that carry the sensor's clock and no counter."""

from dataclasses import dataclass

import numpy as np

from robot_drivers.protocols import FloatArray, IntArray

_WRAP_US = 2**32
_CLOCK_TOLERANCE_S = 0.5
"""By how much host and sensor clock differ at most across an interruption."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Frames in their place: ``index`` into those given, ``counter`` and ``device_time_s``, each (n,)."""

    index: IntArray
    counter: IntArray
    device_time_s: FloatArray


class SampleClock:
    """Counts samples by the sensor's clock.

    Parameters
    ----------
    rate_hz : samples a second

    Attributes
    ----------
    received, lost, duplicated, restarts : samples that came, that were left out, that came again, and how often the
        sensor's clock began anew because it was powered up again
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._last: tuple[int, int, int, int] | None = None  # clock, its unwrapped value, counter, host time
        self.received = self.lost = self.duplicated = self.restarts = 0

    def place(self, time_us: IntArray, host_time_ns: IntArray) -> Placement:
        """Place frames, in order of arrival, by their clock and receive stamps, each (n,)."""
        kept = []
        for index, (clock, stamp_ns) in enumerate(zip(time_us.tolist(), host_time_ns.tolist(), strict=True)):
            placed = self._place_one(clock, stamp_ns)
            if placed is not None:
                kept.append((index, *placed))
        rows = np.array(kept, np.int64).reshape(-1, 3)
        self.received += len(kept)
        return Placement(rows[:, 0], rows[:, 1], 1e-6 * rows[:, 2].astype(np.float64))

    def _place_one(self, clock: int, stamp_ns: int) -> tuple[int, int] | None:
        if self._last is None:
            unwrapped, counter = clock, 0
        else:
            before, unwrapped, counter, before_ns = self._last
            step_us = (clock - before) % _WRAP_US
            steps = round(step_us * 1e-6 * self._rate_hz)
            if steps == 0:
                self.duplicated += 1
                return None
            elapsed_s = (stamp_ns - before_ns) * 1e-9
            # Behind where it was it began anew, unless it is so far on that its 32 bits began again. Ahead of where it
            # can be, what came before had waited: samples are missing.
            if clock < before and step_us * 1e-6 > elapsed_s + _CLOCK_TOLERANCE_S:
                self.restarts += 1
                unwrapped, steps = clock, 1
            else:
                unwrapped += step_us
                self.lost += steps - 1
            counter += steps
        self._last = clock, unwrapped, counter, stamp_ns
        return counter, unwrapped
