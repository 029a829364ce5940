"""How long the client has been silent; of an emulated laboratory, how long while it could have spoken.

A client gives a sign of life many times a second. On a real rig it is silent as soon as the last one is too old,
whatever the reason: a window that gets no processor does not hear its STOP either.

Where only emulated devices move, nobody is in danger, and a slow client is not a silent one. On a busy computer it may
have no sign of life to give because it waits for a processor; the kernel of Linux counts that for every thread, and it
is taken off. Where it is not known, the time in which the watch itself came late is. What is frozen, stopped, blocked
or caught in a computation waits for no processor, and is silent.
"""

import threading
from collections.abc import Callable, Sequence
from pathlib import Path

LIMIT_S = 0.8
"""A client that is silent for longer is not there."""

LONGEST_S = 2.0
"""Nor, of an emulated laboratory, is one without a sign of life for so long, whatever it waits for."""

_SOON_S = 0.2  # a client that was heard so recently is not looked into

ProcessorTime = Callable[[int], tuple[float, float, bool] | None]


def processor_time(thread: int) -> tuple[float, float, bool] | None:
    """Return how long a thread has run and has waited for a processor, s, and whether it runs or waits for one now.

    None where the system does not tell (anywhere but on Linux), or the thread is gone. Source: proc(5) and
    Documentation/scheduler/sched-stats.rst of the kernel.
    """
    place = Path("/proc") / str(thread)
    try:
        used_ns, delayed_ns = (place / "schedstat").read_text().split()[:2]
        state = (place / "stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, ValueError, IndexError):
        return None
    return int(used_ns) * 1e-9, int(delayed_ns) * 1e-9, state == "R"


class Silence:
    """Adds up the silence of one client; :meth:`heard` and :meth:`look` belong to different threads.

    Parameters
    ----------
    period_s : between two looks, if they come in time
    now_s : host clock
    waiting_is_excused : whether waiting for a processor is no silence: of emulated devices alone
    processor_time : what :func:`processor_time` returns of a thread
    """

    def __init__(
        self,
        period_s: float,
        now_s: Callable[[], float],
        *,
        waiting_is_excused: bool,
        processor_time: ProcessorTime = processor_time,
    ) -> None:
        self._waiting_is_excused = waiting_is_excused
        self._longest_step_s = 1.5 * period_s
        self._now_s = now_s
        self._processor_time = processor_time
        self._lock = threading.Lock()
        self._threads: Sequence[int] = ()
        self._heard_s = self._looked_s = now_s()
        self._silent_s = 0.0
        self._before: dict[int, tuple[float, float, bool]] = {}

    def heard(self, threads: Sequence[int] = ()) -> None:
        """Take a sign of life; ``threads`` are, by their native ids, those on which the next one depends."""
        with self._lock:
            self._heard_s = self._looked_s = self._now_s()
            self._silent_s = 0.0
            self._threads = threads or self._threads
            self._before = {}

    def look(self) -> str:
        """Return in words that the client is silent, and for how long; nothing while it is not."""
        with self._lock:
            now_s = self._now_s()
            elapsed_s, self._looked_s = now_s - self._looked_s, now_s
            waited_s = self._waited_s(now_s, elapsed_s) if self._waiting_is_excused else 0.0
            if waited_s is None:
                self._silent_s += min(elapsed_s, self._longest_step_s)
            else:
                self._silent_s += max(0.0, elapsed_s - waited_s)
            if self._silent_s > LIMIT_S:
                return f"the controlling program has been silent for {self._silent_s:.2g} s"
            if now_s - self._heard_s > LONGEST_S:
                return f"the controlling program has given no sign of life for {now_s - self._heard_s:.2g} s"
            return ""

    def _waited_s(self, now_s: float, elapsed_s: float) -> float | None:
        """Return for how long since the last look one of the client's threads waited for a processor.

        None where that is not known: then a look that comes late itself says little.
        """
        if now_s - self._heard_s < _SOON_S:
            return None
        told = {thread: self._processor_time(thread) for thread in self._threads}
        present = {thread: time for thread, time in told.items() if time is not None}
        before, self._before = self._before, present
        waited_s = None
        for thread, (used_s, delayed_s, runnable) in present.items():
            if thread in before:
                used_before_s, delayed_before_s, was_runnable = before[thread]
                # the kernel adds a wait when it ends
                still_s = elapsed_s if runnable and was_runnable and used_s == used_before_s else 0.0
                waited_s = max(waited_s or 0.0, delayed_s - delayed_before_s, still_s)
        return waited_s
