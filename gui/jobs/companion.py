"""A process beside the window that answers one request after the other and remembers what it was told before.

For a long computation with progress there is :mod:`gui.jobs.running`; this is for many short ones on the same things.
"""

import contextlib
import multiprocessing
import queue
import threading
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from PySide6.QtCore import QObject, Signal

from daq.errors import DaqError
from daq.lifeline import leave_signals_to_parent
from daq.progress import Progress
from gui.jobs.process import Failed, Progressed, Reporter
from robot_drivers.errors import DeviceError
from robot_drivers.real_time import give_way

# The window comes first: what its process computes for it may be shown a little later.
_STEPS_BEHIND = 5

_Requests = queue.SimpleQueue[Any]


class Companion(QObject):
    """Runs from construction to :meth:`end`; the process ends with the window, however that goes.

    ``answered`` brings every answer in the order of the requests, ``progressed`` what is said on the way to one (text,
    steps done, steps in all), ``gone`` tells that the process has ended by itself.

    Parameters
    ----------
    make : of a module; called in the process with ``arguments``, and returns what answers the requests, called with
        one and a :class:`daq.progress.Progress`. All of these are pickled. An error of the laboratory is answered with
        :class:`gui.jobs.process.Failed`.
    """

    answered = Signal(object)
    progressed = Signal(str, int, int)
    gone = Signal()

    def __init__(
        self,
        make: Callable[..., Callable[[Any, Progress], Any]],
        arguments: tuple[Any, ...],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        context = multiprocessing.get_context("spawn")
        connection, other = context.Pipe()
        context.Process(target=_serve, args=(other, make, arguments), name=make.__name__, daemon=True).start()
        other.close()
        self._requests: _Requests = queue.SimpleQueue()
        talker = threading.Thread(
            target=self._talk, args=(connection, self._requests), name=f"talk to {make.__name__}", daemon=True
        )
        talker.start()

    def ask(self, request: object) -> None:
        """Ask for an answer."""
        self._requests.put(request)

    def end(self) -> None:
        """End the process once it has answered; does not wait."""
        self._requests.put(_END)

    def _talk(self, connection: Connection, requests: _Requests) -> None:
        with connection:
            while (request := requests.get()) is not _END:
                try:
                    connection.send(request)
                    while isinstance(answer := connection.recv(), Progressed):
                        with _unless_nobody_listens():
                            self.progressed.emit(answer.text, answer.done, answer.total)
                except (EOFError, OSError):
                    with _unless_nobody_listens():
                        self.gone.emit()
                    return
                with _unless_nobody_listens():
                    self.answered.emit(answer)


_END = object()


def _unless_nobody_listens() -> contextlib.AbstractContextManager[None]:
    """Let an emission fail where Qt's object, and with it who asked, has gone while the answer was on its way."""
    return contextlib.suppress(RuntimeError)


def _serve(
    connection: Connection, make: Callable[..., Callable[[Any, Progress], Any]], arguments: tuple[Any, ...]
) -> None:
    """Answer until the other end closes."""
    give_way(_STEPS_BEHIND)
    leave_signals_to_parent()
    answer = make(*arguments)
    while True:
        try:
            request = connection.recv()
        except (EOFError, OSError):  # the window is gone, be it in the middle of a request
            return
        answered = _answered(answer, request, Reporter(partial(_send_if_heard, connection)))
        try:
            connection.send(answered)
        except OSError:
            return


def _send_if_heard(connection: Connection, message: object) -> None:
    """Send what is said on the way to an answer; that nobody listens any more shows when the answer is sent."""
    with contextlib.suppress(OSError):
        connection.send(message)


def _answered(answer: Callable[[Any, Progress], Any], request: object, progress: Progress) -> object:
    try:
        return answer(request, progress)
    except (DaqError, DeviceError) as error:
        return Failed(" ".join(str(error).split()))
