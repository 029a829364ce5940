"""The RDT server of an emulated sensor, written from the byte tables of the manual, not from the driver."""

import select
import socket
import struct
import threading
from dataclasses import dataclass

import numpy as np

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.faults import FaultyLink, LinkCounts
from robot_drivers.clock import host_time_ns
from robot_drivers.protocols import IntArray

_STOP, _START_BUFFERED, _RESET_LATCH, _SET_BIAS = 0x0, 0x3, 0x41, 0x42
_RECORD = np.dtype(
    {
        "names": ["rdt_sequence", "ft_sequence", "status", "counts"],
        "formats": [">u4", ">u4", ">u4", (">i4", 6)],
        "offsets": [0, 4, 8, 12],
        "itemsize": 36,
    }
)
_DATAGRAMS_AT_ONCE = 64  # a longer backlog is worked off in pieces
_IDLE_S = 0.02


@dataclass(frozen=True, slots=True)
class RdtCommands:
    """Which requests a product knows; it ignores others.

    Attributes
    ----------
    single_block : commands that start a stream of one record a datagram
    resets_latch : whether there is one that clears the latch of the monitor conditions
    to_another : whether records can be sent elsewhere than to the one who asks
    """

    single_block: tuple[int, ...] = (0x2,)
    resets_latch: bool = True
    to_another: bool = True


@dataclass(slots=True)
class _Stream:
    """One client's stream; its record k (from 0) is the sample of tick first + ⌊k · internal / rate⌋."""

    client: tuple[str, int]
    records_per_datagram: int
    limit: int
    first_tick: int
    rate_hz: int
    internal_rate_hz: int
    sent: int = 0

    @property
    def finished(self) -> bool:
        return 0 < self.limit <= self.sent

    def due(self, now: int) -> int:
        """Return how many records to send next: whole datagrams, but for the last of a limited stream."""
        due = ((now - self.first_tick + 1) * self.rate_hz - 1) // self.internal_rate_hz + 1
        if 0 < self.limit <= due:
            waiting = self.limit - self.sent
        else:
            waiting = max(0, due - self.sent)
            waiting -= waiting % self.records_per_datagram
        return min(waiting, _DATAGRAMS_AT_ONCE * self.records_per_datagram)

    def ticks(self, n: int) -> IntArray:
        """Return the ticks of the next n records."""
        k = self.sent + np.arange(n, dtype=np.int64)
        return self.first_tick + k * self.internal_rate_hz // self.rate_hz


class RdtServer:
    """Answers RDT requests and streams to the latest client, from a thread of its own."""

    def __init__(self, box: Box, commands: RdtCommands) -> None:
        self._box = box
        self._commands = commands
        self._boots = box.boots
        self._link = FaultyLink(box.settings.seed)
        self._stream: _Stream | None = None
        self._closing = threading.Event()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((box.settings.host, box.settings.rdt_port))
        except OSError:
            self._socket.close()
            raise
        self._thread = threading.Thread(target=self._serve, name="RDT emulator: records")
        self._thread.start()

    @property
    def port(self) -> int:
        """The UDP port in use."""
        return int(self._socket.getsockname()[1])

    @property
    def counts(self) -> LinkCounts:
        """What happened to the records so far."""
        return self._link.counts

    @property
    def behind_s(self) -> float:
        """How late the next record of the stream is, s; 0 without one that could come."""
        stream, box = self._stream, self._box
        if stream is None or stream.finished or not box.reachable:
            return 0.0
        next_tick = stream.first_tick + stream.sent * stream.internal_rate_hz // stream.rate_hz
        return max(0.0, (box.tick() - next_tick) / stream.internal_rate_hz)

    def close(self) -> None:
        """Stop serving."""
        self._closing.set()
        self._thread.join()
        self._socket.close()

    def _serve(self) -> None:
        burst_s = self._box.settings.burst_s
        while not self._closing.is_set():
            readable, _, _ = select.select([self._socket], [], [], burst_s if self._stream else _IDLE_S)
            self._forget_stream_of_former_boot()
            if readable:
                self._answer(*self._socket.recvfrom(64))
            if self._stream is not None:
                self._continue(self._stream)

    def _forget_stream_of_former_boot(self) -> None:
        self._box.update()
        if self._box.boots != self._boots:
            self._boots = self._box.boots
            self._stream = None
            self._link.flush()

    def _answer(self, request: bytes, client: tuple[str, int]) -> None:
        box = self._box
        if not box.reachable or len(request) not in ((8, 14) if self._commands.to_another else (8,)):
            return
        header, command, sample_count = struct.unpack_from(">HHI", request)
        if header != 0x1234 or (command >= 0x8000) != (len(request) == 14):
            return
        if len(request) == 14:
            *address, port = struct.unpack_from(">4BH", request, 8)
            command, client = command - 0x8000, (".".join(map(str, address)), port)
        if command == _STOP:
            self._end_stream()
        elif command in (*self._commands.single_block, _START_BUFFERED):
            self._start_stream(client, box.buffer_size if command == _START_BUFFERED else 1, sample_count)
        elif command == _RESET_LATCH and self._commands.resets_latch:
            box.clear_latch()
        elif command == _SET_BIAS:
            box.set_bias()
            if box.settings.bias_stops_stream:
                self._end_stream()

    def _start_stream(self, client: tuple[str, int], records_per_datagram: int, limit: int) -> None:
        self._end_stream()
        box, internal_rate_hz = self._box, self._box.settings.internal_rate_hz
        if box.settings.rdt_enabled:
            first_tick = box.tick() + round(box.faults.slow_start_s * internal_rate_hz)
            self._stream = _Stream(
                client, records_per_datagram, limit, first_tick, box.rate_hz, internal_rate_hz
            )

    def _end_stream(self) -> None:
        if self._stream is not None:
            self._send(self._link.flush(), self._stream.client)
            self._stream = None

    def _continue(self, stream: _Stream) -> None:
        """Send all that is due: a busy machine delays records but does not lower their rate."""
        now = self._box.tick()
        while True:
            n = stream.due(now)
            self._transmit(stream, self._datagrams(stream, n) if n else [])
            if not stream.due(now):
                break
        if stream.finished:
            self._end_stream()

    def _datagrams(self, stream: _Stream, n: int) -> list[bytes]:
        measured = self._box.sample(stream.ticks(n))
        records = np.empty(n, _RECORD)
        records["rdt_sequence"] = (stream.sent + 1 + np.arange(n)) % 2**32
        records["ft_sequence"] = measured.ft_sequence
        records["status"] = measured.status
        records["counts"] = measured.counts
        stream.sent += n
        content, size = records.tobytes(), stream.records_per_datagram * _RECORD.itemsize
        return [content[start : start + size] for start in range(0, len(content), size)]

    def _transmit(self, stream: _Stream, datagrams: list[bytes]) -> None:
        box = self._box
        leaving = self._link.transmit(datagrams, box.faults, box.plugged_in, host_time_ns())
        self._send(leaving, stream.client)

    def _send(self, datagrams: list[bytes], client: tuple[str, int]) -> None:
        for datagram in datagrams:
            self._socket.sendto(datagram, client)
