"""Short work beside the interface thread, within the program: reading a file, decoding an image.

Long computations belong into :mod:`gui.jobs.running`; what comes here must not hold the interpreter for long.
"""

import queue
import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, QTimer

from daq.errors import DaqError
from estimator.errors import EstimatorError

_LISTEN_MS = 15

_Work = tuple[Callable[[], Any], Callable[[Any], None], Callable[[Exception], None]]


class Background(QObject):
    """One thread that does one thing after the other, and always what was asked for last.

    Of what waits while it is busy only the newest is done: whoever drags a slider wants the last place.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._asked: queue.SimpleQueue[_Work | None] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._thread = threading.Thread(
            target=_work, args=(self._asked, self._done), name="background", daemon=True
        )
        self._thread.start()
        self._timer = QTimer(self, interval=_LISTEN_MS)
        self._timer.timeout.connect(self._deliver)
        asked = self._asked
        self.destroyed.connect(lambda: asked.put(None))
        self._timer.start()

    def do(
        self, work: Callable[[], Any], then: Callable[[Any], None], failed: Callable[[Exception], None]
    ) -> None:
        """Do ``work`` there and call ``then`` with its result here, or ``failed`` with its error."""
        self._asked.put((work, then, failed))

    def end(self) -> None:
        """End the thread and drop what it may still bring."""
        self._timer.stop()
        self._asked.put(None)
        self._thread.join()

    def _deliver(self) -> None:
        while not self._done.empty():
            self._done.get()()


def _work(asked: "queue.SimpleQueue[_Work | None]", done: "queue.SimpleQueue[Callable[[], None]]") -> None:
    while True:
        wanted = asked.get()
        while not asked.empty() and wanted is not None:
            wanted = asked.get()
        if wanted is None:
            return
        work, then, failed = wanted
        try:
            result = work()
        except (DaqError, EstimatorError, OSError) as error:
            done.put(_bound(failed, error))
        else:
            done.put(_bound(then, result))


def _bound(call: Callable[[Any], None], value: object) -> Callable[[], None]:
    return lambda: call(value)
