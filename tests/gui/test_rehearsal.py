"""Waiting while the interface goes on."""

import signal
import time
from types import FrameType

import pytest

from gui.rehearsal import wait_until

pytestmark = pytest.mark.usefixtures("qtbot")


class TooLateError(Exception):
    """As a test's time limit raises it."""


def test_what_holds_already_is_waited_for_no_longer() -> None:
    begun = time.monotonic()
    wait_until(lambda: True, "nothing")
    assert time.monotonic() - begun < 5.0


def test_what_does_not_come_is_named() -> None:
    with pytest.raises(TimeoutError, match=r"the end of a session has not come within 0\.1 s"):
        wait_until(lambda: False, "the end of a session", 0.1)


def test_what_the_condition_raises_ends_the_wait() -> None:
    queue: list[str] = []
    with pytest.raises(IndexError):
        wait_until(lambda: queue[-1] == "done", "the end of a session")


@pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="no such signal on this system")
def test_what_a_signal_raises_ends_the_wait() -> None:
    def too_late(_number: int, _frame: FrameType | None) -> None:
        raise TooLateError

    before = signal.signal(signal.SIGUSR1, too_late)
    try:
        with pytest.raises(TooLateError):
            wait_until(lambda: signal.raise_signal(signal.SIGUSR1) is not None, "the end of a session")
    finally:
        signal.signal(signal.SIGUSR1, before)
