"""How fast the host clock runs beside the computer's own: slower where an emulated laboratory waits."""

from dataclasses import dataclass
from typing import Self

from robot_drivers.clock import host_time_ns, monotonic_time_ns


@dataclass(frozen=True, slots=True)
class Instant:
    """The host clock, and the computer's own, which runs on where an emulated laboratory waits; ns."""

    host_ns: int
    monotonic_ns: int

    @classmethod
    def now(cls) -> Self:
        """Return this instant."""
        return cls(host_time_ns(), monotonic_time_ns())

    def slowdown_since(self) -> float:
        """Return how many times slower than the computer's the host clock has run since."""
        now = Instant.now()
        return (now.monotonic_ns - self.monotonic_ns) / max(1, now.host_ns - self.host_ns)
