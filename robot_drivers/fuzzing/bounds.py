"""Bounds on time and memory for what reads damaged input."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

if sys.platform != "win32":
    import resource

_EXTRA_MEMORY_BYTES = 1 << 30


class HangError(Exception):
    """The time is up."""


@contextmanager
def time_bound() -> Iterator[Callable[[float], None]]:
    """Give a function after which HangError interrupts the main thread after so much CPU time; 0 ends that."""
    if sys.platform == "win32":
        yield lambda _seconds: None
        return

    def hang(_number: int, _frame: object) -> None:
        raise HangError

    before = signal.signal(signal.SIGPROF, hang)
    try:
        yield _set_timer
    finally:
        _set_timer(0.0)
        signal.signal(signal.SIGPROF, before)


@contextmanager
def waiting_bound(seconds: float) -> Iterator[None]:
    """Interrupt the main thread by HangError after so much time, in which it may wait for something for ever."""
    if sys.platform == "win32":
        yield
        return

    def hang(_number: int, _frame: object) -> None:
        raise HangError

    handler = signal.signal(signal.SIGALRM, hang)
    remaining_s, _ = signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, remaining_s)  # whoever else waited goes on waiting
        signal.signal(signal.SIGALRM, handler)


def _set_timer(seconds: float) -> None:
    if sys.platform != "win32":
        signal.setitimer(signal.ITIMER_PROF, seconds)


def limit_memory() -> None:
    """Let this process have a gigabyte more than it has; a parser that wants more meets a MemoryError."""
    if sys.platform == "linux":
        with open("/proc/self/statm", encoding="ascii") as file:  # noqa: PTH123 - no file of anybody's
            pages = int(file.read().split()[0])
        limit = pages * resource.getpagesize() + _EXTRA_MEMORY_BYTES
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
