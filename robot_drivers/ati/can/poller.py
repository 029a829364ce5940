"""Asks a device on a CAN bus for its samples at a steady rate, from a thread of its own."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

from robot_drivers.ati.can.link import Answer
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceTimeoutError


@dataclass(frozen=True, slots=True)
class Sample:
    """One answer, and the number of its request from 1."""

    counter: int
    answer: Answer


class Poller:
    """Polls from construction until :meth:`stop`; the answers wait to be taken.

    Parameters
    ----------
    ask : requests one sample
    recover : called before the next request when one was left unanswered: the device may have been reset
    rate_hz : of the requests

    Attributes
    ----------
    received, lost : requests answered, and left without a whole answer
    """

    def __init__(self, ask: Callable[[], Answer], recover: Callable[[], None], rate_hz: float) -> None:
        self.received = 0
        self.lost = 0
        self._ask = ask
        self._recover = recover
        self._device_is_certain = True
        self._period_ns = round(1e9 / rate_hz)
        self._waiting: list[Sample] = []
        self._failure: DeviceError | None = None
        self._news = threading.Condition()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._poll, name="CAN poller")
        self._thread.start()

    def take(self, timeout_s: float) -> list[Sample]:
        """Return the samples that wait; wait up to ``timeout_s`` for a first one.

        Raises
        ------
        DeviceError
            The bus has failed, or the device could not be recovered; no sample waits any more.
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
                self._take_one(counter)
            except DeviceTimeoutError:
                self.lost += 1
                self._device_is_certain = False
            except DeviceError as error:
                with self._news:
                    self._failure = error
                    self._news.notify_all()
                return
            due_ns = max(due_ns + self._period_ns, host_time_ns())  # missed polls are not made up for

    def _take_one(self, counter: int) -> None:
        if not self._device_is_certain:
            self._recover()
            self._device_is_certain = True
        answer = self._ask()
        with self._news:
            self.received += 1
            self._waiting.append(Sample(counter, answer))
            self._news.notify_all()
