"""The error of an emulated device's clock: it may jump and drift, and what it has gained stays."""

from dataclasses import dataclass
from typing import TypeVar

from robot_drivers.protocols import FloatArray

Time = TypeVar("Time", float, FloatArray)


@dataclass(frozen=True, slots=True)
class ClockError:
    """How far a clock is ahead of what it ought to show: ``ahead_s`` at ``since_s``, and ``drift_ppm`` from then on."""

    ahead_s: float = 0.0
    since_s: float = 0.0
    drift_ppm: float = 0.0

    def at(self, time_s: Time) -> Time:
        """Return how far it is ahead, s, at a time of the undisturbed clock, or at each of several (n,)."""
        return self.ahead_s + 1e-6 * self.drift_ppm * (time_s - self.since_s)

    def disturbed(self, time_s: float, jump_s: float, drift_ppm: float) -> "ClockError":
        """Return the error of a clock that jumps at this time and drifts so from then on."""
        return ClockError(self.at(time_s) + jump_s, time_s, drift_ppm)
