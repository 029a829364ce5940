"""What lets a thread answer a device in time on a busy machine.

Its priority and that of its process, for while another thread that holds the interpreter waits for a processor, nobody
gets on; short turns at the interpreter; short pauses of the collector.
"""

import contextlib
import gc
import os
import sys

_PRIORITY = 10  # of 1 to 99: before every ordinary program, behind the kernel's own interrupt threads (50)
_NICENESS = -10  # of -20 to 19: nine times the share of an ordinary program
_TURN_S = 5e-4  # of 5 ms, Python's own


def prefer_this_thread() -> bool:
    """Ask the system to run the calling thread before all ordinary ones; return whether it will.

    For a thread that sleeps until its device speaks, and answers at once. Linux grants it to root and to whom
    ``/etc/security/limits.conf`` gives an ``rtprio`` of 10 or more; without the grant all works as before, later
    under load. Elsewhere it is never granted.
    """
    if sys.platform == "linux":
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
            return True
    return False


def prefer_this_process() -> bool:
    """Give the calling thread, and all that it will start, a large share of the processors; return whether it will.

    For a process that must keep up with its devices; call it before any thread starts. Linux grants it to root and to
    whom ``/etc/security/limits.conf`` gives a ``nice`` of -10. Elsewhere it is never granted.
    """
    if sys.platform == "linux":
        with contextlib.suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, 0, _NICENESS)
            return True
    return False


def give_way(steps: int) -> None:
    """Lower the priority of the calling process by some steps of niceness, below that of the process it came from.

    For a computation beside devices. Windows knows no niceness; there nothing changes.
    """
    if hasattr(os, "nice"):
        os.nice(steps)


def shorten_turns() -> None:
    """Let a thread that wakes up wait for half a millisecond only for the one which holds the interpreter."""
    sys.setswitchinterval(_TURN_S)


def shorten_collections() -> None:
    """Let the garbage collector pass over what exists now, for a process that is set up and must keep time.

    A full collection holds all threads up, some 20 ms with NumPy and the rest imported; nearly all of what it then
    looks at came with the imports and will never be garbage.
    """
    gc.collect()
    gc.freeze()
