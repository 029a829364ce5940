"""The clock of the emulated controller: it counts cycles from power-up, and may jump and drift beside the host's."""

from robot_drivers.abb.emulator.arm import CYCLE_S
from robot_drivers.clock import host_time_ns
from robot_drivers.emulated_clock import ClockError


class ControllerClock:
    """Shows zero at power-up and runs at the host's rate until it is disturbed.

    Attributes
    ----------
    epoch_ns : host time at which it would have shown zero, by what it shows now
    cycles : since power-up, of :data:`CYCLE_S` each
    """

    def __init__(self) -> None:
        self.epoch_ns = host_time_ns()
        self.cycles = 0
        self._error = ClockError()

    @property
    def powered_s(self) -> float:
        """True time since power-up, s."""
        return self.cycles * CYCLE_S

    @property
    def shown_us(self) -> int:
        """What it shows, µs."""
        return max(0, round((self.powered_s + self._error.at(self.powered_s)) * 1e6))

    def tick(self, due_ns: int) -> None:
        """Let one cycle pass, that is due at this host time."""
        self.cycles += 1
        self.epoch_ns = due_ns - 1000 * self.shown_us

    def disturb(self, jump_s: float, drift_ppm: float) -> None:
        """Jump now, and drift from now on, until the next power-up."""
        self._error = self._error.disturbed(self.powered_s, jump_s, drift_ppm)
