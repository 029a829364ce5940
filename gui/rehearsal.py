"""The whole window driven by a program, for screenshots and for measurements."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from PySide6.QtCore import QEventLoop, QMessageLogContext, QTimer, QtMsgType, qInstallMessageHandler
from PySide6.QtWidgets import QApplication

from gui.theme import Theme, apply_theme
from robot_drivers.real_time import prefer_this_process

_LOOK_MS = 20
# What a platform without a display says of every window.
_OF_NO_CONCERN = "This plugin does not support propagateSizeHints()"


@contextmanager
def application_without_display(theme: Theme) -> Iterator[QApplication]:
    """Give the application of a command that needs no display, and takes one where ``QT_QPA_PLATFORM`` names it."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    qInstallMessageHandler(_tell)
    prefer_this_process()
    application = QApplication(sys.argv[:1])
    application.setQuitOnLastWindowClosed(False)
    apply_theme(application, theme)
    yield application


def _tell(_kind: QtMsgType, _context: QMessageLogContext, message: str) -> None:
    if message != _OF_NO_CONCERN:
        sys.stderr.write(f"{message}\n")


def wait_until(condition: Callable[[], bool], what: str, timeout_s: float = 60.0) -> None:
    """Let the interface go on until a condition holds.

    Whatever is raised while it is looked at ends the wait and is raised here: what a slot raises Qt only prints.

    Raises
    ------
    TimeoutError
        It did not within that time.
    """
    deadline = time.monotonic() + timeout_s
    loop, timer = QEventLoop(), QTimer(interval=_LOOK_MS)
    raised: list[BaseException] = []

    def look() -> None:
        try:
            if condition() or time.monotonic() > deadline:
                loop.quit()
        # also what the handler of a signal raises, as that of a test's time limit
        except BaseException as error:  # noqa: BLE001
            raised.append(error)
            loop.quit()

    timer.timeout.connect(look)
    timer.start()
    # the loop sleeps between events, as it does in the window: a measurement must not load the computer by itself
    loop.exec()
    timer.stop()
    if raised:
        raise raised[0]
    if not condition():
        raise TimeoutError(f"{what} has not come within {timeout_s:g} s")


def wait_for(seconds: float) -> None:
    """Let the interface go on for a while."""
    ends = time.monotonic() + seconds
    wait_until(lambda: time.monotonic() >= ends, "the end of the wait", seconds + 5.0)
