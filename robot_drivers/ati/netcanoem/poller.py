"""Asks a NETCANOEM board for its gages at a steady rate, from a thread of its own."""

import threading
from dataclasses import dataclass

from robot_drivers.ati.netcanoem.frames import Opcode, decode_gages
from robot_drivers.ati.netcanoem.link import BoardLink
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceTimeoutError
from robot_drivers.protocols import StreamStatistics


@dataclass(frozen=True, slots=True)
class GageSample:
    """One answer: number of the request (from 1), host times in ns, status word, readings of gages 0..5."""

    counter: int
    requested_ns: int
    received_ns: int
    status: int
    gages: tuple[int, ...]


class Poller:
    """Polls from construction until :meth:`stop`; the answers wait to be taken.

    A board that left a request unanswered may have been reset, and then uses another calibration. So the
    calibration is selected again before the next request.
    """

    def __init__(self, link: BoardLink, calibration: int, rate_hz: float) -> None:
        self._link = link
        self._calibration = calibration
        self._calibration_is_certain = True
        self._period_ns = round(1e9 / rate_hz)
        self._received = 0
        self._lost = 0
        self._waiting: list[GageSample] = []
        self._failure: DeviceError | None = None
        self._news = threading.Condition()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._poll, name="NETCANOEM poller")
        self._thread.start()

    @property
    def statistics(self) -> StreamStatistics:
        """Counts so far; a request without a whole answer is a lost sample."""
        return StreamStatistics(received=self._received, lost=self._lost, malformed=self._link.malformed)

    def take(self, timeout_s: float) -> list[GageSample]:
        """Return the samples that wait; wait up to ``timeout_s`` for a first one.

        Raises
        ------
        DeviceUnreachableError, DeviceProtocolError
            The bus has failed, or the board lost its calibration; no sample waits any more.
        """
        with self._news:
            self._news.wait_for(lambda: self._waiting or self._failure, timeout_s)
            if self._failure and not self._waiting:
                raise self._failure
            taken, self._waiting = self._waiting, []
            return taken

    def stop(self) -> None:
        """End polling; what has arrived can still be taken."""
        self._stopping.set()
        self._thread.join()

    def _poll(self) -> None:
        counter, due_ns = 0, host_time_ns()
        while not self._stopping.wait(max(0, due_ns - host_time_ns()) * 1e-9):
            counter += 1
            try:
                self._ask(counter)
            except DeviceTimeoutError:
                self._lost += 1
                self._calibration_is_certain = False
            except DeviceError as error:
                with self._news:
                    self._failure = error
                    self._news.notify_all()
                return
            due_ns = max(due_ns + self._period_ns, host_time_ns())  # missed polls are not made up for

    def _ask(self, counter: int) -> None:
        if not self._calibration_is_certain:
            self._link.select_calibration(self._calibration)
            self._calibration_is_certain = True
        answer = self._link.ask(Opcode.GAGES)
        status, gages = decode_gages(*answer.frames)
        sample = GageSample(counter, answer.requested_ns, answer.received_ns, status, gages)
        with self._news:
            self._received += 1
            self._waiting.append(sample)
            self._news.notify_all()
