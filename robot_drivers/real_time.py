"""What lets a thread answer a device in time on a busy machine: its priority, and short pauses of the collector."""

import contextlib
import gc
import os
import sys

_PRIORITY = 10  # of 1 to 99: before every ordinary program, behind the kernel's own interrupt threads (50)


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


def shorten_collections() -> None:
    """Let the garbage collector pass over what exists now, for a process that is set up and must keep time.

    A full collection holds all threads up, some 20 ms with NumPy and the rest imported; nearly all of what it then
    looks at came with the imports and will never be garbage.
    """
    gc.collect()
    gc.freeze()
