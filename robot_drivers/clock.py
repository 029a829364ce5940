"""The one clock of the host: monotonic, in nanoseconds, never stepped by time services."""

import time

_RAW = getattr(time, "CLOCK_MONOTONIC_RAW", None)


def host_time_ns() -> int:
    """Return the host clock in ns: ``CLOCK_MONOTONIC_RAW`` where there is one, else ``time.monotonic_ns``."""
    return time.monotonic_ns() if _RAW is None else time.clock_gettime_ns(_RAW)


def wall_to_host_offset_ns() -> int:
    """Return (host clock − wall clock) in ns, to carry kernel receive stamps (wall clock) to the host clock.

    The wall clock is read between two readings of the host clock; the tightest of five such brackets wins.
    """
    best_width, best_offset = None, 0
    for _ in range(5):
        before = host_time_ns()
        wall = time.time_ns()
        after = host_time_ns()
        if best_width is None or after - before < best_width:
            best_width, best_offset = after - before, (before + after) // 2 - wall
    return best_offset
