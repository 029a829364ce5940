"""How a verb is ended from outside: SIGTERM and a closed terminal interrupt it as Ctrl-C does.

A verb that is interrupted holds the robot, seals what is recorded and ends the processes that it has started.
"""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_STATUS_OF_SIGNALS = 128


class Terminated(KeyboardInterrupt):
    """A signal has asked the program to end; ``status`` is its exit status by the shell's convention."""

    status = _STATUS_OF_SIGNALS + signal.SIGTERM


@contextmanager
def interrupted_by_signals() -> Iterator[None]:
    """Raise Terminated in the main thread at the first SIGTERM or SIGHUP; those that follow are not heard.

    Who has the signal ignored, as ``nohup`` does with SIGHUP, keeps it ignored.
    """
    wanted = [signal.SIGTERM, *filter(None, [getattr(signal, "SIGHUP", None)])]
    heard = [number for number in wanted if signal.getsignal(number) is not signal.SIG_IGN]
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    terminals = [stream.fileno() for stream in (sys.__stdout__, sys.__stderr__) if stream and stream.isatty()]

    def end(number: int, _: FrameType | None) -> None:
        for one in heard:
            signal.signal(one, signal.SIG_IGN)
        if number != signal.SIGTERM:
            _speak_to_nobody(terminals)
        raise Terminated(f"ended by {signal.Signals(number).name}")

    before = {number: signal.signal(number, end) for number in heard}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _speak_to_nobody(terminals: list[int]) -> None:
    """Let what is still to be said go nowhere: writing to a terminal that is gone is an error."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for terminal in terminals:
        os.dup2(nowhere, terminal)
    os.close(nowhere)
