"""The whole window driven by a program, for screenshots and for measurements."""

import time
from collections.abc import Callable

from PySide6.QtCore import QEventLoop, QTimer

_LOOK_MS = 20


def wait_until(condition: Callable[[], bool], what: str, timeout_s: float = 60.0) -> None:
    """Let the interface go on until a condition holds.

    Raises
    ------
    TimeoutError
        It did not within that time.
    """
    deadline = time.monotonic() + timeout_s
    loop, look = QEventLoop(), QTimer(interval=_LOOK_MS)
    look.timeout.connect(lambda: loop.quit() if condition() or time.monotonic() > deadline else None)
    look.start()
    # the loop sleeps between events, as it does in the window: a measurement must not load the computer by itself
    loop.exec()
    look.stop()
    if not condition():
        raise TimeoutError(f"{what} has not come within {timeout_s:g} s")


def wait_for(seconds: float) -> None:
    """Let the interface go on for a while."""
    ends = time.monotonic() + seconds
    wait_until(lambda: time.monotonic() >= ends, "the end of the wait", seconds + 5.0)
