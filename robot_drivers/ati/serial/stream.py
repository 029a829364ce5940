"""Counters and times for the records of a sensor that sends neither.

What is known: the order of the records, their bytes, when the bytes came, and about how many records a second the
sensor sends. What is estimated: how many are missing. Damaged stretches are counted by their bytes, at once. Silences
are counted by the pace of arrival, once late bytes can be told from lost ones; until then the counter lags.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.serial.framing import Decoder
from robot_drivers.clock import host_time_ns
from robot_drivers.protocols import IntArray, StreamStatistics
from robot_drivers.serial_line.receiver import Chunk, SerialReceiver

_SILENCE_NS = 50_000_000
_VERDICT_NS = 250_000_000
_SMALLEST_LOSS_S = 0.02


@dataclass(frozen=True, slots=True)
class Samples:
    """Records with their place in time, oldest first.

    Attributes
    ----------
    counter : (n,) int64, from 0, with the missing records counted in
    host_time_ns : (n,) int64, when the last byte of each was found
    status, values : as in :class:`~robot_drivers.ati.serial.framing.Records`
    """

    counter: IntArray
    host_time_ns: IntArray
    status: IntArray
    values: NDArray[np.int32]


class ArrivalPace:
    """Finds records missing by the pace of arrivals: they can be late for a while, but not for ever.

    In every window of a quarter of a second without a silence the arrival that lags least behind the nominal rate
    counts. Where that lag grew from one window to the next by more than 20 ms, records are lost. What is less than
    that, as a slightly different rate, is followed and not counted.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._begin_ns = self._newest_ns = self._verdict_ns = 0
        self._records = 0.0
        self._least_lag = math.inf  # records
        self._former_lag = math.inf

    def missing(self, host_time_ns: int, records: float) -> int:
        """Take the number of records that arrived at a time; return how many are now known to be missing."""
        if not self._begin_ns:
            self._begin_ns, self._verdict_ns = host_time_ns, host_time_ns + _VERDICT_NS
        elif host_time_ns - self._newest_ns > _SILENCE_NS:
            self._former_lag = min(self._former_lag, self._least_lag)
            self._least_lag, self._verdict_ns = math.inf, host_time_ns + _VERDICT_NS
        self._newest_ns = host_time_ns
        self._records += records
        lag = (host_time_ns - self._begin_ns) * 1e-9 * self._rate_hz - self._records
        self._least_lag = min(self._least_lag, lag)
        return self._verdict() if host_time_ns >= self._verdict_ns else 0

    def _verdict(self) -> int:
        growth = self._least_lag - self._former_lag
        missing = round(growth) if growth > max(1.0, _SMALLEST_LOSS_S * self._rate_hz) else 0
        self._records += missing
        self._former_lag, self._least_lag = self._least_lag - missing, math.inf
        self._verdict_ns = self._newest_ns + _VERDICT_NS
        return missing


class SampleStream:
    """The stream that one start opened; :meth:`resume` goes on with it after the sensor was started again."""

    def __init__(self, receiver: SerialReceiver, decoder: Decoder, rate_hz: float) -> None:
        self.receiver = receiver
        self._decoder = decoder
        self._pace = ArrivalPace(rate_hz)
        self._chunk_ends: list[
            int
        ] = []  # positions in the stream, of chunks that undelivered records may end in
        self._chunk_stamps: list[int] = []
        self._bytes_read = 0
        self._offset = 0  # of the counter over the decoder's index
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
        self._bytes_read = 0
        self._offset = self._last_counter + 1

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
        for chunk in chunks:
            self._bytes_read += len(chunk.data)
            self._offset += self._pace.missing(
                chunk.host_time_ns, len(chunk.data) / self._decoder.record_size
            )
            self._chunk_ends.append(self._bytes_read)
            self._chunk_stamps.append(chunk.host_time_ns)
        records = self._decoder.feed(b"".join(chunk.data for chunk in chunks))
        chunk_index = np.searchsorted(self._chunk_ends, records.end)
        samples = Samples(
            counter=records.index + self._offset,
            host_time_ns=np.array(self._chunk_stamps, np.int64)[chunk_index],
            status=records.status,
            values=records.values,
        )
        if len(records.index):
            self._received += len(records.index)
            self._last_counter = int(samples.counter[-1])
            del self._chunk_ends[: chunk_index[-1]], self._chunk_stamps[: chunk_index[-1]]
        return samples
