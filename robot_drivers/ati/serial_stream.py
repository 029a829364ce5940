"""Counters and times for the records of a sensor that sends neither.

What is known: the order of the records, their bytes, when the bytes came, and about how many records a second the
sensor sends. What is estimated: how many are missing. Damaged stretches are counted by their bytes, silences by
their length. Whole records lost in less than :data:`SHORTEST_LOSS_S` leave no trace.
"""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.serial_framing import Decoder
from robot_drivers.ati.serial_receiver import Chunk, SerialReceiver
from robot_drivers.clock import host_time_ns
from robot_drivers.protocols import IntArray, StreamStatistics

SHORTEST_LOSS_S = 0.02
"""Time for which records must be missing after a silence to be taken for lost and not for late."""

_SILENCE_NS = 50_000_000
_SETTLING_S = 0.02  # bytes that were only late follow a silence within this time


@dataclass(frozen=True, slots=True)
class Samples:
    """Records with their place in time, oldest first.

    Attributes
    ----------
    counter : (n,) int64, from 0, with the missing records counted in
    host_time_ns : (n,) int64, when the last byte of each was found
    status, values : as in :class:`~robot_drivers.ati.serial_framing.Records`
    """

    counter: IntArray
    host_time_ns: IntArray
    status: IntArray
    values: NDArray[np.int32]


class SampleStream:
    """The stream that one start opened; :meth:`resume` goes on with it after the sensor was started again."""

    def __init__(self, receiver: SerialReceiver, decoder: Decoder, rate_hz: float) -> None:
        self.receiver = receiver
        self._decoder = decoder
        self._rate_hz = rate_hz
        self._newest_ns: int | None = None
        self._chunk_ends: list[
            int
        ] = []  # positions in the stream, of chunks that undelivered records may end in
        self._chunk_stamps: list[int] = []
        self._bytes_read = 0
        self._silence_at = 0  # position in the stream before which the former offset holds
        self._former_offset = self._offset = 0  # of the counter over the decoder's index
        self._last_counter = -1
        self._received = self._restarts = self._earlier_damages = 0

    @property
    def statistics(self) -> StreamStatistics:
        """Counts so far; ``lost`` is an estimate, ``malformed`` counts damaged stretches."""
        return StreamStatistics(
            received=self._received,
            lost=self._last_counter + 1 - self._received,
            restarts=self._restarts,
            malformed=self._earlier_damages + self._decoder.damages,
        )

    def resume(self, receiver: SerialReceiver, decoder: Decoder) -> None:
        """Go on with the bytes of a new start; the time without any counts as missing records."""
        self.receiver = receiver
        self._restarts += 1
        self._earlier_damages += self._decoder.damages
        self._decoder = decoder
        self._chunk_ends, self._chunk_stamps = [], []
        self._bytes_read = self._silence_at = 0
        self._former_offset = self._offset = self._last_counter + 1

    def read(self, timeout_s: float) -> Samples:
        """Return the records that have become certain; wait up to ``timeout_s`` for a first one.

        Raises
        ------
        DeviceUnreachableError
            The port has failed, and everything that came before has been returned.
        """
        deadline_ns = host_time_ns() + round(timeout_s * 1e9)
        while True:
            chunks = self.receiver.take(max(0.0, (deadline_ns - host_time_ns()) * 1e-9))
            samples = self._samples(chunks)
            if len(samples.counter) or host_time_ns() >= deadline_ns:
                return samples

    def _samples(self, chunks: list[Chunk]) -> Samples:
        if chunks and self._newest_ns is not None and chunks[0].host_time_ns - self._newest_ns > _SILENCE_NS:
            time.sleep(_SETTLING_S)
            chunks = chunks + self.receiver.take(0.0)
            self._count_silence(chunks, self._newest_ns)
        for chunk in chunks:
            self._bytes_read += len(chunk.data)
            self._newest_ns = chunk.host_time_ns
            self._chunk_ends.append(self._bytes_read)
            self._chunk_stamps.append(chunk.host_time_ns)
        records = self._decoder.feed(b"".join(chunk.data for chunk in chunks))
        offset = np.where(records.end > self._silence_at, self._offset, self._former_offset)
        chunk_index = np.searchsorted(self._chunk_ends, records.end)
        samples = Samples(
            counter=records.index + offset,
            host_time_ns=np.array(self._chunk_stamps, np.int64)[chunk_index],
            status=records.status,
            values=records.values,
        )
        if len(records.index):
            self._received += len(records.index)
            self._last_counter = int(samples.counter[-1])
            del self._chunk_ends[: chunk_index[-1]], self._chunk_stamps[: chunk_index[-1]]
        return samples

    def _count_silence(self, chunks: list[Chunk], silent_since_ns: int) -> None:
        """Count the records that should have come since the silence began and did not come after it."""
        elapsed_s = (chunks[-1].host_time_ns - silent_since_ns) * 1e-9
        came = sum(len(chunk.data) for chunk in chunks) / self._decoder.record_size
        missing = elapsed_s * self._rate_hz - came
        if missing > max(1.0, SHORTEST_LOSS_S * self._rate_hz):
            self._silence_at = self._bytes_read
            self._former_offset, self._offset = self._offset, self._offset + round(missing)
