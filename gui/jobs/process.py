"""A long computation in a process of its own: what happens there, and what it tells the window.

Nothing here imports Qt, so that the process starts quickly. The window holds the other end of a lifeline: when that
closes, because the job was cancelled or because the window is gone, however it went, the computation is interrupted as
if from the keyboard, its own workers end, and after a short while the process ends in any case.
"""

import _thread
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from daq.errors import DaqError
from estimator.errors import EstimatorError
from robot_drivers.errors import DeviceError
from robot_drivers.real_time import give_way

# How long a computation may take to clear up after an interruption.
GRACE_S = 2.0

# The devices come first where the same computer records.
_STEPS_BEHIND = 2


@dataclass(frozen=True, slots=True)
class Progressed:
    """What is being done, and how many of how many steps of it are."""

    text: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class Shown:
    """A result on the way."""

    value: object


@dataclass(frozen=True, slots=True)
class Finished:
    """The result."""

    value: object


@dataclass(frozen=True, slots=True)
class Failed:
    """Why there is no result, in one line."""

    message: str


Message = Progressed | Shown | Finished | Failed


class Reporter:
    """What a computation tells its progress (:class:`daq.progress.Progress`), and shows results on the way to."""

    def __init__(self, send: Callable[[Message], None]) -> None:
        self._send = send

    def __call__(self, text: str, done: int, total: int) -> None:
        """Tell what is being done, and how much of it is."""
        self._send(Progressed(text, done, total))

    def show(self, value: object) -> None:
        """Hand over a result on the way; it is pickled."""
        self._send(Shown(value))


def run(
    messages: Connection, lifeline: Connection, task: Callable[..., object], arguments: tuple[Any, ...]
) -> None:
    """Carry out ``task(reporter, *arguments)`` and send what it says, its result or its one-line error.

    Any other error is one of the program: it is left to the interpreter, which prints it and ends the process.
    """
    give_way(_STEPS_BEHIND)
    cut = threading.Event()
    threading.Thread(target=_watch, args=(lifeline, cut), name="lifeline", daemon=True).start()
    try:
        messages.send(_outcome(task, Reporter(messages.send), arguments))
    except BaseException:
        if not cut.is_set():
            raise
    finally:
        messages.close()


def _outcome(task: Callable[..., object], reporter: Reporter, arguments: tuple[Any, ...]) -> Message:
    try:
        return Finished(task(reporter, *arguments))
    except (DaqError, EstimatorError, DeviceError) as error:
        return Failed(" ".join(str(error).split()))
    except OSError as error:
        return Failed(f"{error.filename or 'file'}: {error.strerror or error}")


def _watch(lifeline: Connection, cut: threading.Event) -> None:
    """Wait for the end of the lifeline, then end the computation and its workers."""
    try:
        lifeline.recv()
    except EOFError:
        cut.set()
    if sys.platform == "win32":
        _thread.interrupt_main()
    else:
        # a signal also wakes a thread that waits for a lock or sleeps
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    _end_workers()
    time.sleep(GRACE_S)
    _end_workers()
    os._exit(1)


def _end_workers() -> None:
    for worker in multiprocessing.active_children():
        worker.kill()
