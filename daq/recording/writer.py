"""The one thread that writes: device threads hand it packets of finished records through a bounded buffer.

What came within a fiftieth of a second goes into one chunk of each file. A packet that finds the buffer full is
dropped, counted, and told in the file itself. Nobody waits for the disk but the writer.
"""

import queue
import threading
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from typing import NamedTuple

from daq.errors import RecordingError
from daq.recording.mcap.chunks import Rows
from daq.recording.mcap.log import McapLog

_BUFFER_BYTES = 256 * 2**20
_BATCH_PERIOD_S = 0.02
_SYNC_PERIOD_S = 0.5
_EVENT_PATIENCE_S = 5.0


class Packet(NamedTuple):
    """Rows for one file: ``samples`` of them of one stream."""

    log: McapLog
    rows: Rows
    stream: str
    samples: int


class RecordWriter:
    """Appends packets to their files in a thread of its own, and brings the files to the disk twice a second.

    Attributes
    ----------
    written : samples of each stream that are safe from the death of this process
    """

    def __init__(
        self,
        logs: Sequence[McapLog],
        tell_dropped: Callable[[dict[str, int]], Packet],
        buffer_bytes: int = _BUFFER_BYTES,
        tell_failure: Callable[[RecordingError], None] = lambda failure: None,
    ) -> None:
        self.written: Counter[str] = Counter()
        self._logs = logs
        self._tell_dropped = tell_dropped
        self._tell_failure = tell_failure
        self._buffer_bytes = buffer_bytes
        self._queue: queue.SimpleQueue[Packet] = queue.SimpleQueue()
        self._room = threading.Condition()
        self._waiting_bytes = 0
        self._dropped: Counter[str] = Counter()
        self._error: OSError | None = None
        self._closing = threading.Event()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._write, name="record-writer")
        self._syncer = threading.Thread(target=self._sync, name="record-sync")
        self._thread.start()
        self._syncer.start()

    @property
    def filling(self) -> float:
        """How full the buffer is, 0 to 1."""
        return self._waiting_bytes / self._buffer_bytes

    def offer(self, packet: Packet) -> None:
        """Hand over samples; never waits for the disk."""
        with self._room:
            if not self._enqueue(packet):
                self._dropped[packet.stream] += packet.samples

    def insist(self, packet: Packet) -> None:
        """Hand over what must not be dropped; waits, and raises RecordingError when the disk does not follow."""
        with self._room:
            if not self._room.wait_for(lambda: self._enqueue(packet), timeout=_EVENT_PATIENCE_S):
                raise RecordingError(
                    f"{packet.log.path}: the disk has not followed for {_EVENT_PATIENCE_S:g} s; use a faster disk"
                ) from self._error

    def drop(self, stream: str, samples: int) -> None:
        """Count samples that were lost before they became a packet."""
        with self._room:
            self._dropped[stream] += samples

    def dropped(self) -> dict[str, int]:
        """Return the samples of each stream that did not get into the file."""
        with self._room:
            return dict(self._dropped)

    def check(self) -> None:
        """Raise RecordingError when writing has failed."""
        if self._error is not None:
            raise _failure(self._error) from self._error

    def close(self) -> None:
        """Write everything handed over so far and end both threads."""
        self._closing.set()
        self._thread.join()
        self._closed.set()
        self._syncer.join()

    def _enqueue(self, packet: Packet) -> bool:
        """Put the packet into the buffer if there is room; called with the lock held."""
        if self._waiting_bytes + packet.rows.size > self._buffer_bytes:
            return False
        self._waiting_bytes += packet.rows.size
        self._queue.put(packet)
        return True

    def _write(self) -> None:
        told: dict[str, int] = {}
        last = False
        while not last:
            last = self._closing.wait(_BATCH_PERIOD_S)
            self._append(self._take())
            if (dropped := self.dropped()) != told and self._error is None:
                told = dropped
                self._append([self._tell_dropped(told)])

    def _take(self) -> list[Packet]:
        """Return what waits, and make room for more."""
        batch = []
        while not self._queue.empty():
            batch.append(self._queue.get())
        return batch

    def _append(self, batch: Sequence[Packet]) -> None:
        by_log: defaultdict[McapLog, list[Packet]] = defaultdict(list)
        for packet in batch:
            by_log[packet.log].append(packet)
        for log, packets in by_log.items():
            if self._error is None:
                try:
                    log.append(*(packet.rows for packet in packets))
                except OSError as error:
                    self._fail(error)
            with self._room:
                for packet in packets:
                    counter = self._dropped if self._error else self.written
                    counter[packet.stream] += packet.samples
                    self._waiting_bytes -= packet.rows.size
                self._room.notify_all()

    def _sync(self) -> None:
        while not self._closed.wait(_SYNC_PERIOD_S):
            try:
                for log in self._logs:
                    log.sync()
            except OSError as error:
                self._fail(error)

    def _fail(self, error: OSError) -> None:
        """Give up writing, and tell it at once: whoever moves a robot meanwhile asks only when it stands."""
        if self._error is None:
            self._error = error
            self._tell_failure(_failure(error))


def _failure(error: OSError) -> RecordingError:
    return RecordingError(f"{error.filename or 'recording'}: cannot be written ({error})")
