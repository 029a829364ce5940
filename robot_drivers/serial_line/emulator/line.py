"""The far end of a serial line: a pseudo-terminal, or a TCP port where the system has none, and its faults."""

import os
import select
import socket
import sys
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from robot_drivers.emulated_outages import Outages

if sys.platform != "win32":
    import tty

_HOST_BUFFER_BYTES = 65536
_MOST_READ = 4096


class FarEnd(Protocol):
    """Where an emulated device is wired to. What the host does not read piles up as far as its buffer goes."""

    @property
    def port(self) -> str:
        """What a client opens with pyserial."""

    def receive(self, timeout_s: float) -> bytes:
        """Return what the host sent; wait up to ``timeout_s`` for it."""

    def send(self, data: bytes) -> None:
        """Send to the host, without waiting; what its buffer cannot take is lost."""

    def close(self) -> None:
        """Pull the adapter out: an open port fails."""


class PseudoTerminal:
    """A pseudo-terminal, which a client opens like any serial port. POSIX only."""

    def __init__(self) -> None:
        # the slave stays open, so that the line outlives its clients
        self._master, self._slave = os.openpty()
        self.port = os.ttyname(self._slave)
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._unsent = b""

    def receive(self, timeout_s: float) -> bytes:
        """Return what the host sent; wait up to ``timeout_s`` for it."""
        self.send(b"")
        readable, _, _ = select.select([self._master], [], [], timeout_s)
        return os.read(self._master, _MOST_READ) if readable else b""

    def send(self, data: bytes) -> None:
        """Send to the host, without waiting; what its buffer cannot take is lost."""
        self._unsent = (self._unsent + data)[:_HOST_BUFFER_BYTES]
        with suppress(BlockingIOError):
            while self._unsent:
                self._unsent = self._unsent[os.write(self._master, self._unsent) :]

    def close(self) -> None:
        """Pull the adapter out: an open port fails."""
        os.close(self._slave)
        os.close(self._master)


class TcpPort:
    """A server for one client at a time, which opens it as ``socket://``."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = "socket://{}:{}".format(*self._server.getsockname())
        self._client: socket.socket | None = None
        self._unsent = b""

    def receive(self, timeout_s: float) -> bytes:
        """Return what the host sent; wait up to ``timeout_s`` for it."""
        self.send(b"")
        sockets = [self._server, *([self._client] if self._client else [])]
        readable, _, _ = select.select(sockets, [], [], timeout_s)
        if self._server in readable:
            self._hang_up()
            self._client, _ = self._server.accept()
            self._client.setblocking(False)
        elif self._client in readable:
            with suppress(ConnectionError):
                if data := self._client.recv(_MOST_READ):
                    return data
            self._hang_up()
        return b""

    def send(self, data: bytes) -> None:
        """Send to the host, without waiting; what its buffer cannot take is lost."""
        self._unsent = (self._unsent + data)[:_HOST_BUFFER_BYTES] if self._client else b""
        try:
            while self._client is not None and self._unsent:
                self._unsent = self._unsent[self._client.send(self._unsent) :]
        except BlockingIOError:
            return
        except ConnectionError:
            self._hang_up()

    def close(self) -> None:
        """Pull the adapter out: an open port fails."""
        self._hang_up()
        self._server.close()

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


def far_end() -> FarEnd:
    """Return a pseudo-terminal, or a TCP port where the system has none."""
    return PseudoTerminal() if sys.platform != "win32" else TcpPort()


@dataclass(frozen=True, slots=True, kw_only=True)
class LineFaults(Outages):
    """What goes wrong between device and host; the default is nothing. Times count from the injection.

    Attributes
    ----------
    loss, insertion, corruption : probability for each byte to be lost, followed by a random one, or replaced by one
    rubbish : probability for each burst that random bytes follow it
    rubbish_bytes : the fewest and the most of them
    delay_s : extra time that every byte to the host spends on its way
    unplug_at_s, unplug_for_s : the cable is out meanwhile; the device goes on
    restart_at_s, restart_for_s : the device has no power meanwhile, and then begins as new
    """

    loss: float = 0.0
    insertion: float = 0.0
    corruption: float = 0.0
    rubbish: float = 0.0
    rubbish_bytes: tuple[int, int] = (1, 40)
    delay_s: float = 0.0


@dataclass(slots=True)
class LineCounts:
    """Bytes that went wrong; ``unplugged`` are those sent while the cable was out."""

    lost: int = 0
    inserted: int = 0
    corrupted: int = 0
    unplugged: int = 0


class FaultyWire:
    """Damages bytes on their way to the host, as faults demand, and counts what it did."""

    def __init__(self, seed: int) -> None:
        self.counts = LineCounts()
        self._random = np.random.default_rng(seed)

    def transmit(self, data: bytes, faults: LineFaults) -> bytes:
        """Return what arrives of a burst."""
        if not data or not (faults.loss or faults.insertion or faults.corruption or faults.rubbish):
            return data
        sent = np.frombuffer(data, np.uint8)
        n = len(sent)
        change = np.where(self._random.random(n) < faults.corruption, self._random.integers(1, 256, n), 0)
        lost = self._random.random(n) < faults.loss
        added = self._random.random(n) < faults.insertion
        pairs = np.stack([sent ^ change.astype(np.uint8), self._random.integers(0, 256, n, np.uint8)], axis=1)
        arriving = pairs[np.stack([~lost, added], axis=1)].tobytes()
        rubbish = b""
        if self._random.random() < faults.rubbish:
            rubbish = self._random.bytes(int(self._random.integers(*faults.rubbish_bytes, endpoint=True)))
        self.counts.lost += int(lost.sum())
        self.counts.inserted += int(added.sum()) + len(rubbish)
        self.counts.corrupted += int((change[~lost] != 0).sum())
        return arriving + rubbish
