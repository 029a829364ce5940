"""The link's own thread: it owns the client of the acquisition process, and shares little with the interface thread."""

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal, Slot

from daq.acquisition.client import Acquisition
from daq.acquisition.failures import failure_of
from daq.acquisition.messages import Close, Command, Open, Refused, Telemetry
from daq.acquisition.viewing.channels import Analysis
from daq.errors import DaqError, SessionError
from daq.rig import Rig
from robot_drivers.errors import DeviceError

_LISTEN_MS = 8
_MOST_ROWS = 400


class Exchange:
    """What the two threads share: the beat one way, the newest telemetry the other, with no row of it lost."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._beaten = False
        self._telemetry: Telemetry | None = None

    def beat(self) -> None:
        """Give a sign of life."""
        with self._lock:
            self._beaten = True

    def take(self) -> Telemetry | None:
        """Take what came since the last time; None where an earlier call has taken it."""
        with self._lock:
            seen, self._telemetry = self._telemetry, None
            return seen

    def heard(self) -> bool:
        """Tell whether there was a beat since the last call."""
        with self._lock:
            beaten, self._beaten = self._beaten, False
            return beaten

    def put(self, seen: Telemetry) -> None:
        """Leave telemetry to be taken, together with what still lies there."""
        with self._lock:
            before = self._telemetry
            self._telemetry = seen if before is None else _joined(before, seen)

    def clear(self) -> None:
        """Forget the telemetry of a process that has ended."""
        with self._lock:
            self._telemetry = None


def _joined(before: Telemetry, after: Telemetry) -> Telemetry:
    return replace(
        after,
        force=np.concatenate([before.force, after.force])[-_MOST_ROWS:],
        pose=np.concatenate([before.pose, after.pose])[-_MOST_ROWS:],
        images={**before.images, **after.images},
    )


class Worker(QObject):
    """Owns the client; everything here happens in the link's thread.

    Signals
    -------
    opened : the devices are connected; dict of their identities by role
    reported : what the process reports
    arrived : telemetry lies in the exchange
    failed : Failure, the devices could not be connected or the process is gone
    closed : the devices have been let go
    """

    opened = Signal(object)
    reported = Signal(object)
    arrived = Signal()
    failed = Signal(object)
    closed = Signal()

    def __init__(self, exchange: Exchange) -> None:
        super().__init__()
        self._exchange = exchange
        self._acquisition: Acquisition | None = None
        self._seen: Telemetry | None = None
        self._timer = QTimer(self, interval=_LISTEN_MS)
        self._timer.timeout.connect(self._listen)

    @Slot(object)
    def obey(self, command: Command | Analysis) -> None:
        """Carry out a command; what needs devices is refused without them."""
        match command:
            case Analysis():
                self._guarded(lambda acquisition: acquisition.show(command))
            case Open(rig):
                self._open(rig)
            case Close():
                self._close()
            case _ if self._acquisition is None:
                error = SessionError("no device is connected; connect the rig first")
                self.reported.emit(Refused(failure_of(error)))
            case _:
                self._guarded(lambda acquisition: acquisition.send(command))

    @Slot()
    def end(self) -> None:
        """Let go, and end the thread."""
        self._let_go()
        self.thread().quit()

    def _open(self, rig: Rig) -> None:
        self._let_go()
        try:
            self._acquisition = Acquisition(rig)
        except (DaqError, DeviceError, OSError) as error:
            self.failed.emit(failure_of(error))
            return
        self._timer.start()
        self.opened.emit(dict(self._acquisition.devices))

    def _close(self) -> None:
        self._let_go()
        self.closed.emit()

    def _let_go(self) -> None:
        self._timer.stop()
        acquisition, self._acquisition, self._seen = self._acquisition, None, None
        if acquisition is not None:
            acquisition.close()
        self._exchange.clear()

    def _listen(self) -> None:
        self._guarded(self._hear)

    def _hear(self, acquisition: Acquisition) -> None:
        if self._exchange.heard():
            acquisition.show_alive()
        if (seen := acquisition.telemetry) is not None and seen is not self._seen:
            self._seen = seen
            self._exchange.put(seen)
            self.arrived.emit()
        while (report := acquisition.listen()) is not None:
            self.reported.emit(report)

    def _guarded(self, act: Callable[[Acquisition], None]) -> None:
        """Talk to the process; where it is gone, say so and let go."""
        if self._acquisition is None:
            return
        try:
            act(self._acquisition)
        except DaqError as error:
            self._let_go()
            self.failed.emit(failure_of(error))
