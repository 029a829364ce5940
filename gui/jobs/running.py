"""Long computations beside the window: each in a process of its own, heard by signals, cancelled at once.

A job belongs to the interface thread. Its process is started, and what it says received, by a thread, and taken from
there by a timer, so that neither a process that is slow to start nor a busy or silent one ever blocks the window.

Where the system can, the processes are copies of one that has loaded what computations need, so that only the first
job spends its first seconds importing, and none after :meth:`Jobs.prepare`.
"""

import multiprocessing
import queue
import sys
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from PySide6.QtCore import QCoreApplication, QObject, QTimer, Signal

from gui.jobs.process import GRACE_S, Failed, Finished, Message, Progressed, Shown, run

if sys.platform == "win32":
    _CONTEXT = multiprocessing.get_context("spawn")
else:
    from multiprocessing import forkserver

    _CONTEXT = multiprocessing.get_context("forkserver")
    _CONTEXT.set_forkserver_preload(["gui.analysis.following"])

_LISTEN_MS = 30
_END_S = GRACE_S + 3.0


class Job(QObject):
    """One computation, running from construction on.

    Signals, all in the interface thread: ``progressed`` (text, steps done, steps in all), ``shown`` (a result on the
    way), then one of ``finished`` (the result), ``failed`` (one line: what, where, what to do) and ``cancelled``, and
    after it ``ended``.

    Parameters
    ----------
    title : what is being computed, for a person
    task : a function of a module, called there as ``task(reporter, *arguments)`` with a
        :class:`gui.jobs.process.Reporter`; it, the arguments and the result are pickled
    """

    progressed = Signal(str, int, int)
    shown = Signal(object)
    finished = Signal(object)
    failed = Signal(str)
    cancelled = Signal()
    ended = Signal()

    def __init__(
        self, title: str, task: Callable[..., object], arguments: tuple[Any, ...], parent: QObject
    ) -> None:
        super().__init__(parent)
        self.title = title
        self.running = True
        messages, told = _CONTEXT.Pipe(duplex=False)
        watched, self._lifeline = _CONTEXT.Pipe(duplex=False)
        self._process = _CONTEXT.Process(target=run, args=(told, watched, task, arguments), name=title)
        self._heard: queue.SimpleQueue[Message | None] = queue.SimpleQueue()
        self._listener = threading.Thread(
            target=_listen,
            args=(self._process, (told, watched), messages, self._heard),
            name=f"job {title}",
            daemon=True,
        )
        self._listener.start()
        self._outcome: Message | None = None
        self._asked_to_end = False
        self._timer = QTimer(self, interval=_LISTEN_MS)
        self._timer.timeout.connect(self._hear)
        self._timer.start()

    def cancel(self) -> None:
        """Ask the computation to end and drop what it may still bring; ``cancelled`` follows. Does not wait."""
        self._asked_to_end = True
        self._lifeline.close()

    def join(self) -> None:
        """Wait until the process is gone: for the end of the program, after :meth:`cancel`. No signal follows."""
        self._timer.stop()
        self._listener.join()
        self._lifeline.close()
        self._process.close()
        self.running = False

    def _hear(self) -> None:
        while not self._heard.empty():
            match message := self._heard.get():
                case Progressed(text, done, total):
                    self.progressed.emit(text, done, total)
                case Shown(value):
                    self.shown.emit(value)
                case Finished() | Failed():
                    self._outcome = message
                case None:
                    self._end()
                    return

    def _end(self) -> None:
        """Tell the outcome; the process is gone."""
        status = self._process.exitcode
        self.join()
        match self._outcome:
            case _ if self._asked_to_end:
                self.cancelled.emit()
            case Finished(value):
                self.finished.emit(value)
            case Failed(message):
                self.failed.emit(message)
            case _:
                self.failed.emit(
                    f"{self.title}: the computation has ended without a result (exit status {status}); what it said "
                    "is on the terminal; start it again"
                )
        self.ended.emit()


class Jobs(QObject):
    """The jobs that run; all of them end with the application.

    ``changed`` is emitted when one begins or has ended.
    """

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.running: tuple[Job, ...] = ()
        application = QCoreApplication.instance()
        if application is not None:
            application.aboutToQuit.connect(self.close)

    def prepare(self) -> None:
        """Load what computations need before one is started; does not wait."""
        if sys.platform != "win32":
            forkserver.ensure_running()

    def start(self, title: str, task: Callable[..., object], *arguments: object) -> Job:
        """Begin a computation and return it; connect its signals at once, for it speaks from the event loop only."""
        job = Job(title, task, arguments, self)
        self.running = (*self.running, job)
        job.ended.connect(self._forget)
        self.changed.emit()
        return job

    def close(self) -> None:
        """Cancel all jobs and wait until their processes are gone: some seconds at most."""
        for job in self.running:
            job.cancel()
        for job in self.running:
            job.join()
        self.running = ()

    def _forget(self) -> None:
        ended = [job for job in self.running if not job.running]
        self.running = tuple(job for job in self.running if job.running)
        for job in ended:
            job.deleteLater()
        self.changed.emit()


def _listen(
    process: BaseProcess,
    ends: tuple[Connection, Connection],
    messages: Connection,
    heard: queue.SimpleQueue[Message | None],
) -> None:
    """Start a process, pass on what it says, wait until it is gone, and see to it that it goes."""
    try:
        # the first one waits for a second or two until the process that it is a copy of has loaded everything
        process.start()
        # from here on the ends of the child are its own, so that either side notices when the other is gone
        for end in ends:
            end.close()
        while True:
            heard.put(messages.recv())
    except (EOFError, OSError):
        process.join(_END_S)
        if process.is_alive():
            process.kill()
            process.join()
    finally:
        messages.close()
        heard.put(None)
