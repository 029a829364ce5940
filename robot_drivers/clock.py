"""The one clock of the host: monotonic, in nanoseconds, never stepped by time services.

A process may instead live on the clock of an emulated laboratory (:mod:`robot_drivers.laboratory_clock`), which runs
slower where its emulators would not keep up. Then everything that this module tells is on that clock.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from robot_drivers.protocols import IntArray

_RAW = getattr(time, "CLOCK_MONOTONIC_RAW", None)
_HELD_PAUSE_S = 0.001


class Reader(Protocol):
    """A thread that reads a device, and says how far it has come, so that emulated devices can wait for it."""

    def caught_up(self, time_ns: int) -> None:
        """Say that all that came before this host time has been dealt with."""

    def close(self) -> None:
        """Say that it reads no more."""


class HostClock(Protocol):
    """What tells the time of a process; it never goes back."""

    def time_ns(self) -> int:
        """Return the time now, ns."""

    def times_ns(self, monotonic_ns: IntArray) -> IntArray:
        """Return what it showed (n,) at some past instants of the computer's monotonic clock."""

    def reader(self) -> Reader:
        """Return a reader that has come as far as now."""


class MonotonicClock:
    """The computer's own monotonic clock."""

    def time_ns(self) -> int:
        """Return the time now, ns."""
        return monotonic_time_ns()

    def times_ns(self, monotonic_ns: IntArray) -> IntArray:
        """Return the instants themselves."""
        return monotonic_ns

    def reader(self) -> Reader:
        """Return a reader for which nothing waits."""
        return _ReaderAlone()


class _ReaderAlone:
    """A reader of real devices: they wait for nobody."""

    def caught_up(self, time_ns: int) -> None:
        """Go on."""

    def close(self) -> None:
        """Go."""


# What a process has only one of; the last is the host clock now.
_clocks: list[HostClock] = [MonotonicClock()]


@contextmanager
def living_on(clock: HostClock) -> Iterator[None]:
    """Let all threads of this process live on another clock meanwhile; for emulated devices only."""
    _clocks.append(clock)
    try:
        yield
    finally:
        _clocks.remove(clock)


def monotonic_time_ns() -> int:
    """Return the computer's own clock in ns: ``CLOCK_MONOTONIC_RAW`` where there is one, else monotonic time."""
    return time.monotonic_ns() if _RAW is None else time.clock_gettime_ns(_RAW)


def host_time_ns() -> int:
    """Return the host clock in ns: :func:`monotonic_time_ns`, unless this process lives on another clock."""
    return _clocks[-1].time_ns()


def host_time_s() -> float:
    """Return the host clock in s."""
    return host_time_ns() * 1e-9


def host_times_ns(monotonic_ns: IntArray) -> IntArray:
    """Return what the host clock showed (n,) at some past instants of the computer's own clock."""
    return _clocks[-1].times_ns(monotonic_ns)


def new_reader() -> Reader:
    """Return a reader of devices on the host clock."""
    return _clocks[-1].reader()


def seconds_until(time_ns: int) -> float:
    """Return how long to wait before looking again whether the host clock shows ``time_ns``; 0 once it does.

    Of a clock that stands still that is a moment.
    """
    left_s = (time_ns - host_time_ns()) * 1e-9
    return max(left_s, _HELD_PAUSE_S) if left_s > 0.0 else 0.0


def wait_until(time_ns: int) -> None:
    """Sleep until the host clock shows ``time_ns``."""
    while (pause_s := seconds_until(time_ns)) > 0.0:
        time.sleep(pause_s)


def wall_to_monotonic_offset_ns() -> int:
    """Return (monotonic clock − wall clock) in ns, to carry kernel receive stamps (wall clock) to the former.

    The wall clock is read between two readings of the monotonic one; the tightest of five such brackets wins.
    """
    best_width, best_offset = None, 0
    for _ in range(5):
        before = monotonic_time_ns()
        wall = time.time_ns()
        after = monotonic_time_ns()
        if best_width is None or after - before < best_width:
            best_width, best_offset = after - before, (before + after) // 2 - wall
    return best_offset
