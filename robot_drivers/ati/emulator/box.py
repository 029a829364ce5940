"""The state of an emulated sensor on RDT: clock, transducer, configurations. Its servers share one."""

import math
import threading
from dataclasses import dataclass

import numpy as np

from robot_drivers.ati.emulator.faults import Faults
from robot_drivers.ati.emulator.settings import BoxConfiguration, EmulatorSettings
from robot_drivers.ati.emulator.transducers import Transducer
from robot_drivers.clock import host_time_ns
from robot_drivers.emulated_clock import ClockError
from robot_drivers.emulated_wrench import WrenchSource
from robot_drivers.protocols import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Measurement:
    """Samples of the transducer: ``ft_sequence`` (n,), ``status`` (n,), ``counts`` (n, 6)."""

    ft_sequence: IntArray
    status: IntArray
    counts: IntArray


class Box:
    """The box itself. Its time is counted in ticks: internal samples since it was built.

    Attributes
    ----------
    rate_hz, buffer_size : RDT output rate and records per buffered datagram of the next stream
    boots : how often it was powered up
    tool_transform : as received (units, then hundredths). It is kept but not applied: the manual pages at
        hand do not define the order of its rotations
    epoch_ns : host time of tick 0
    """

    def __init__(self, source: WrenchSource, settings: EmulatorSettings, transducer: Transducer) -> None:
        self.settings = settings
        self._transducer = transducer
        self.rate_hz = settings.rate_hz
        self.buffer_size = settings.buffer_size
        self.boots = 1
        self.tool_transform: tuple[int, ...] = (3, 1, 0, 0, 0, 0, 0, 0)
        self.epoch_ns = host_time_ns()
        self._source = source
        self._ticks_per_ns = settings.internal_rate_hz * (1 + settings.clock_ppm * 1e-6) * 1e-9
        self._random = np.random.default_rng(settings.seed)
        self._lock = threading.RLock()
        self._counts_per_si = self.configuration.counts_per_si
        self._boot_tick = 0
        self._bias = np.zeros(6)
        self._latched = False
        self._knot: tuple[np.int64, FloatArray] | None = None
        self._faults = Faults()
        self._injected_at = 0
        self._restart_due = False
        self._clock_error = ClockError()

    @property
    def configuration(self) -> BoxConfiguration:
        """The active configuration."""
        return self.settings.configurations[self.settings.active_configuration]

    @property
    def faults(self) -> Faults:
        """The faults in force."""
        return self._faults

    def tick(self) -> int:
        """Return the newest internal sample's number, from 1."""
        return max(1, int((host_time_ns() - self.epoch_ns) * self._ticks_per_ns))

    def inject(self, faults: Faults) -> None:
        """Replace the faults in force."""
        with self._lock:
            self.update()
            self._faults = faults
            self._injected_at = self.tick()
            self._restart_due = True

    def disturb_clock(self, jump_s: float, drift_ppm: float) -> None:
        """Let ``ft_sequence`` jump, and drift from now on; until the box is restarted."""
        with self._lock:
            now_s = self.tick() / self.settings.internal_rate_hz
            self._clock_error = self._clock_error.disturbed(now_s, jump_s, drift_ppm)

    def update(self) -> None:
        """Carry out a restart that has become due."""
        with self._lock:
            if self._restart_due and self._elapsed() >= self._faults.restart_at_s:
                self._restart_due = False
                back_s = self._faults.restart_at_s + self._faults.restart_for_s
                self._boot_tick = self._injected_at + round(back_s * self.settings.internal_rate_hz)
                self._bias = np.zeros(6)
                self._latched = False
                self._clock_error = ClockError()
                self.boots += 1

    @property
    def reachable(self) -> bool:
        """Whether the box hears a request."""
        return self.powered and self.plugged_in

    @property
    def plugged_in(self) -> bool:
        """Whether the network cable is in."""
        return not self._faults.unplugged(self._elapsed())

    @property
    def powered(self) -> bool:
        """Whether the box is not just being restarted."""
        return not self._faults.unpowered(self._elapsed())

    def set_bias(self) -> None:
        """Subtract the present load, free of noise, from now on."""
        with self._lock:
            now = np.array([self.tick()])
            self._bias = self._load(now, self._true_wrench(now))[0][0]

    def latch(self) -> None:
        """Trip a monitor condition."""
        self._latched = True

    def clear_latch(self) -> None:
        """Clear the monitor-condition latch."""
        self._latched = False

    def sample_now(self) -> Measurement:
        """Take one sample."""
        with self._lock:
            now = np.array([self.tick()])
            return self._measure(now, self._true_wrench(now))

    def sample(self, ticks: IntArray) -> Measurement:
        """Take the samples of a stream, (n,) ascending ticks up to now."""
        with self._lock:
            return self._measure(ticks, self._interpolated_wrench(ticks))

    def _measure(self, ticks: IntArray, wrench: FloatArray) -> Measurement:
        load, status = self._load(ticks, wrench)
        status = status | (self._transducer.latched if self._latched else 0) | self._faults.status
        noise = self._random.standard_normal((len(ticks), 6)) * self.settings.noise_std
        counts = np.rint((load - self._bias + noise) * self._counts_per_si)
        return Measurement(
            (ticks - self._boot_tick + self._ticks_ahead(ticks)) % 2**32,
            status,
            np.clip(counts, -(2**31), 2**31 - 1).astype(np.int64),
        )

    def _ticks_ahead(self, ticks: IntArray) -> IntArray:
        """Return how far, in ticks, a disturbed clock is ahead."""
        rate_hz = self.settings.internal_rate_hz
        return np.rint(self._clock_error.at(ticks / rate_hz) * rate_hz).astype(np.int64)

    def _load(self, ticks: IntArray, wrench: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return what the transducer makes of the wrench, (n, 6), and its status words, (n,)."""
        if any(self._faults.drift_per_s):
            elapsed = (ticks - self._injected_at) / self.settings.internal_rate_hz
            wrench = wrench + np.outer(elapsed, self._faults.drift_per_s)
        return self._transducer.felt(ticks, wrench, self._faults.saturated)

    def _true_wrench(self, ticks: IntArray | FloatArray) -> FloatArray:
        times_s = (ticks / self.settings.internal_rate_hz).tolist()
        return np.array([self._source(time_s) for time_s in times_s], np.float64).reshape(-1, 6)

    def _interpolated_wrench(self, ticks: IntArray) -> FloatArray:
        """Evaluate the source once per burst, never ahead of time, and interpolate in between."""
        burst = self.settings.burst_s * self.settings.internal_rate_hz
        start, end = ticks[[0, -1]]
        if self._knot is None or not 0 < start - self._knot[0] <= burst:
            self._knot = start - 1, self._true_wrench(start - [1])[0]
        first, value = self._knot
        pieces = math.ceil((end - first) / burst)
        length = (end - first) / pieces
        values = np.vstack([value, self._true_wrench(first + length * np.arange(1, pieces + 1))])
        self._knot = end, values[-1]
        piece = np.minimum((ticks - first) // length, pieces - 1).astype(np.int64)
        share = (ticks - first) / length - piece
        wrench: FloatArray = values[piece] + share[:, np.newaxis] * (values[piece + 1] - values[piece])
        return wrench

    def _elapsed(self) -> float:
        return (self.tick() - self._injected_at) / self.settings.internal_rate_hz
