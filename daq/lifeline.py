"""Programs that end together: what starts a process holds a lifeline, and whoever was started ends where that closes.

``python -m daq.lifeline MODULE ARGUMENTS`` runs a module as ``python -m MODULE ARGUMENTS`` does, with standard input as
the lifeline: when its other end closes, because the program there has closed it or is gone, however it went, the module
is told to end by SIGTERM, and after a while its process ends in any case. A pipe does this on every system, where the
parent's death can be asked for on Linux alone.
"""

import multiprocessing
import os
import runpy
import signal
import sys
import threading
import time

# a recording is sealed by its acquisition process, also where this program ends first
_GRACE_S = 60.0
_TO_ALL_AT_ONCE = ("SIGINT", "SIGHUP")


def with_lifeline(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module whose standard input, a pipe, is its lifeline."""
    return [sys.executable, "-m", "daq.lifeline", module, *arguments]


def leave_signals_to_parent(*others: str) -> None:
    """Ignore what keyboard and terminal send to all processes at once: the parent hears it, and says what is done.

    Parameters
    ----------
    others : names of further signals, such as "SIGTERM" for what must outlive a group that is told to end
    """
    for name in (*_TO_ALL_AT_ONCE, *others):
        if (number := getattr(signal, name, None)) is not None:  # Windows has no SIGHUP
            signal.signal(number, signal.SIG_IGN)


def end_with_parent() -> None:
    """Have this process, of :mod:`multiprocessing`, end at once when the one that started it is gone."""
    threading.Thread(target=_wait_for_parent, name="lifeline", daemon=True).start()


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _wait_for_end_of_input() -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_GRACE_S)
    os._exit(1)


if __name__ == "__main__":
    del sys.argv[0]
    threading.Thread(target=_wait_for_end_of_input, name="lifeline", daemon=True).start()
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
