"""The whole window driven by a program, for screenshots and for measurements."""

import time
from collections.abc import Callable

from PySide6.QtCore import QCoreApplication, QEventLoop, QThread


def wait_until(condition: Callable[[], bool], what: str, timeout_s: float = 60.0) -> None:
    """Let the interface go on until a condition holds.

    Raises
    ------
    TimeoutError
        It did not within that time.
    """
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"{what} has not come within {timeout_s:g} s")
        QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 20)
        QThread.msleep(5)


def wait_for(seconds: float) -> None:
    """Let the interface go on for a while."""
    ends = time.monotonic() + seconds
    wait_until(lambda: time.monotonic() >= ends, "the end of the wait", seconds + 5.0)
