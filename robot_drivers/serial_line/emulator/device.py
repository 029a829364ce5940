"""Runs an emulated serial device in real time: its clock, its power, its line and what goes wrong on that."""

import threading
from collections import deque
from typing import Protocol

from robot_drivers.clock import host_time_ns
from robot_drivers.closing import ClosedAtExit
from robot_drivers.serial_line.emulator.line import FarEnd, FaultyWire, LineCounts, LineFaults, far_end


class SerialDeviceModel(Protocol):
    """A device as its line sees it. Times are s since power was first applied, and never go back."""

    def power_up(self) -> None:
        """Begin as new."""

    def hear(self, data: bytes, time_s: float) -> bytes:
        """Take bytes from the host; return the answer."""

    def stream(self, time_s: float) -> bytes:
        """Return what has become due of a running stream."""


class SerialDeviceEmulator(ClosedAtExit):
    """A device at the end of a line, from construction until :meth:`close`, also as a context manager.

    Parameters
    ----------
    model : what it is
    seed : of the faults
    burst_s : time between two bursts of its stream
    line : what it is wired to; by default a pseudo-terminal where there is one

    Attributes
    ----------
    port : what a client opens with pyserial
    epoch_ns : host time at which the device time is zero
    """

    def __init__(
        self, model: SerialDeviceModel, seed: int, burst_s: float, line: FarEnd | None = None
    ) -> None:
        self.epoch_ns = host_time_ns()
        self._model = model
        self._burst_s = burst_s
        self._line = line or far_end()
        self.port = self._line.port
        self._wire = FaultyWire(seed)
        self._faults = LineFaults()
        self._injected_ns = self.epoch_ns
        self._restart_due = False
        self._on_the_way: deque[tuple[int, bytes]] = deque()
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"emulated device on {self.port}")
        model.power_up()
        self._thread.start()

    @property
    def counts(self) -> LineCounts:
        """What happened to the bytes so far."""
        return self._wire.counts

    def inject(self, faults: LineFaults) -> None:
        """Replace the faults in force; ``LineFaults()`` ends them."""
        with self._lock:
            self._faults = faults
            self._injected_ns = host_time_ns()
            self._restart_due = True

    def close(self) -> None:
        """Pull the adapter out and switch the device off."""
        if not self._closing.is_set():
            self._closing.set()
            self._thread.join()
            self._line.close()

    def _run(self) -> None:
        while not self._closing.is_set():
            heard = self._line.receive(self._burst_s)
            with self._lock:
                self._work(heard, host_time_ns())

    def _work(self, heard: bytes, now_ns: int) -> None:
        faults, elapsed_s = self._faults, (now_ns - self._injected_ns) * 1e-9
        if elapsed_s >= faults.restart_at_s and self._restart_due:
            self._restart_due = False
            self._model.power_up()
        time_s = (now_ns - self.epoch_ns) * 1e-9
        if faults.unpowered(elapsed_s):
            return
        unplugged = faults.unplugged(elapsed_s)
        sent = self._model.stream(time_s)
        if heard and not unplugged:
            sent += self._model.hear(heard, time_s)
        if unplugged:
            self.counts.unplugged += len(sent)
        else:
            arriving = self._wire.transmit(sent, faults)
            self._on_the_way.append((now_ns + round(faults.delay_s * 1e9), arriving))
        while self._on_the_way and self._on_the_way[0][0] <= now_ns:
            self._line.send(self._on_the_way.popleft()[1])
