"""What can go wrong between the emulated box and its client, on demand and counted exactly."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from robot_drivers.emulated_outages import Outages

_RECORD_SIZE = 36


@dataclass(frozen=True, slots=True, kw_only=True)
class Faults(Outages):
    """Departures from a healthy sensor; the default is none. Times count from the injection.

    Attributes
    ----------
    loss, duplication, reordering, truncation : probability for each datagram to be lost, sent twice,
        overtaken by its successor, or cut short
    rubbish : probability that random bytes follow a datagram
    delay_s : extra time every datagram spends on its way
    slow_start_s : time between a start request and the first record
    unplug_at_s, unplug_for_s : the network cable is out meanwhile; the box goes on
    restart_at_s, restart_for_s : the box loses power meanwhile, and with it stream, bias, latch and
        ``ft_sequence``
    saturated : all gages at the end of their range
    drift_per_s : wrench error that grows with time, N/s and N·m/s
    status : bits raised in the status word
    """

    loss: float = 0.0
    duplication: float = 0.0
    reordering: float = 0.0
    truncation: float = 0.0
    rubbish: float = 0.0
    delay_s: float = 0.0
    slow_start_s: float = 0.0
    saturated: bool = False
    drift_per_s: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    status: int = 0

    @property
    def spare_the_link(self) -> bool:
        """Whether datagrams pass undisturbed."""
        return not (
            self.loss
            or self.duplication
            or self.reordering
            or self.truncation
            or self.rubbish
            or self.delay_s
        )


@dataclass(slots=True)
class LinkCounts:
    """What happened to the records of all streams; ``dropped`` are those that never arrived intact."""

    records: int = 0
    dropped: int = 0
    duplicated: int = 0
    reordered: int = 0
    truncated_datagrams: int = 0
    rubbish_datagrams: int = 0


class FaultyLink:
    """The way of datagrams to the client."""

    def __init__(self, seed: int) -> None:
        self.counts = LinkCounts()
        self._random = np.random.default_rng(seed)
        self._overtaken: bytes | None = None
        self._on_the_way: deque[tuple[int, bytes]] = deque()

    def transmit(
        self, datagrams: Iterable[bytes], faults: Faults, plugged_in: bool, now_ns: int
    ) -> list[bytes]:
        """Take what the box sends and return what leaves the cable now."""
        leaving: list[bytes] = []
        for datagram in datagrams:
            self.counts.records += len(datagram) // _RECORD_SIZE
            if not plugged_in:
                self._drop(datagram)
            elif faults.spare_the_link:
                leaving += [datagram, *self._overtaken_datagram()]
            else:
                leaving += self._disturb(datagram, faults)
        release_ns = now_ns + round(faults.delay_s * 1e9)
        self._on_the_way.extend((release_ns, datagram) for datagram in leaving)
        released = []
        while self._on_the_way and self._on_the_way[0][0] <= now_ns:
            released.append(self._on_the_way.popleft()[1])
        return released

    def flush(self) -> list[bytes]:
        """Return what is still on its way when a stream ends."""
        rest = [datagram for _, datagram in self._on_the_way]
        if self._overtaken is not None:
            rest.append(self._overtaken)
        self._on_the_way.clear()
        self._overtaken = None
        return rest

    def _disturb(self, datagram: bytes, faults: Faults) -> list[bytes]:
        lost, cut, overtaken, doubled, followed = self._random.random(5) < (
            faults.loss,
            faults.truncation,
            faults.reordering,
            faults.duplication,
            faults.rubbish,
        )
        if lost:
            self._drop(datagram)
            return []
        if cut:
            self._drop(datagram)
            self.counts.truncated_datagrams += 1
            return [datagram[: -self._random.integers(1, _RECORD_SIZE)]]
        if overtaken and self._overtaken is None:
            self._overtaken = datagram
            return []
        leaving = [datagram]
        if doubled:
            self.counts.duplicated += len(datagram) // _RECORD_SIZE
            leaving.append(datagram)
        leaving += self._overtaken_datagram()
        if followed:
            self.counts.rubbish_datagrams += 1
            leaving.append(self._random.bytes(int(self._random.integers(1, 2 * _RECORD_SIZE))))
        return leaving

    def _overtaken_datagram(self) -> list[bytes]:
        """Return the datagram that has just been overtaken, if any."""
        if self._overtaken is None:
            return []
        datagram, self._overtaken = self._overtaken, None
        self.counts.reordered += len(datagram) // _RECORD_SIZE
        return [datagram]

    def _drop(self, datagram: bytes) -> None:
        self.counts.dropped += len(datagram) // _RECORD_SIZE
