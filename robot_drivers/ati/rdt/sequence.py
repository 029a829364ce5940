"""Where each RDT record belongs in its stream, and what is missing: 32-bit numbers to unwrapped counters.

``rdt_sequence`` counts the records of one output stream from 1; ``ft_sequence`` counts internal samples
("ticks") since power-up. A record belongs to the present stream when both moved the same way and by amounts
that fit each other. That tells a late record from a restarted box, and keeps rubbish that has the length of
a record out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.protocols import IntArray, StreamStatistics

MAX_TICKS_PER_RECORD = 8000
"""Internal samples between two records at the slowest output rate, 1 Hz (7912 for the fastest Axia)."""

TRUSTED_STEP = 8192
"""A record further than this from the newest one needs a second one that confirms it, and is itself not used."""

_NEIGHBOURS = 16
"""A record further than this from the newest one must also keep the pace of the records before."""

_REMEMBERED_GAPS = 256
_CLOCK_TOLERANCE_S = 0.5
"""By how much host and device clock differ at most across an interruption of the network."""


@dataclass(frozen=True, slots=True)
class Placement:
    """The records of a batch that are to be used, in order of arrival.

    Attributes
    ----------
    index : (n,) int64, their positions in the batch
    counter : (n,) int64, record counter: consecutive records differ by 1, and it never starts again
    tick : (n,) int64, internal samples since power-up, unwrapped. It falls back to 0 with the first record after
        the box was powered up again: nothing tells how long it was off, so this clock begins a new epoch
    """

    index: IntArray
    counter: IntArray
    tick: IntArray


@dataclass(frozen=True, slots=True)
class _Position:
    rdt_sequence: int
    ft_sequence: int
    counter: int
    tick: int
    host_time_ns: int


class _Gaps:
    """Counters that were passed over and may still arrive late; the oldest gaps are forgotten."""

    def __init__(self) -> None:
        self._gaps: list[range] = []

    def add(self, start: int, stop: int) -> None:
        if start < stop:
            self._gaps.append(range(start, stop))
            del self._gaps[:-_REMEMBERED_GAPS]

    def fill(self, counter: int) -> bool:
        for position, gap in enumerate(self._gaps):
            if counter in gap:
                rest = (range(gap.start, counter), range(counter + 1, gap.stop))
                self._gaps[position : position + 1] = [part for part in rest if part]
                return True
        return False

    def clear(self) -> None:
        self._gaps.clear()


class SequenceTracker:
    """Follows the stream that one start request opened, across restarts.

    Parameters
    ----------
    internal_rate_hz : internal samples per second
    """

    def __init__(self, internal_rate_hz: float = 7000.0) -> None:
        self._ticks_per_ns = internal_rate_hz * 1e-9
        self._newest: _Position | None = None
        self._suspect: tuple[int, int] | None = None
        self._ticks_per_record: int | None = None
        self._gaps = _Gaps()
        self._start_requested = True
        self._received = self._lost = self._duplicated = self._late = self._restarts = self._strange = 0

    @property
    def statistics(self) -> StreamStatistics:
        """Counts so far; ``malformed`` are records that fit no stream."""
        return StreamStatistics(
            self._received, self._lost, self._duplicated, self._late, self._restarts, self._strange
        )

    def expect_start(self) -> None:
        """Tell that a start request was sent: the next record that steps back begins a new stream."""
        self._start_requested = True

    def place(
        self, rdt_sequence: NDArray[np.uint32], ft_sequence: NDArray[np.uint32], host_time_ns: IntArray
    ) -> Placement:
        """Place the records of a batch (all (n,), in order of arrival).

        The receive stamps only decide whether the box was powered up again between two streams.
        """
        newest = self._newest
        if newest is None or not len(rdt_sequence):
            return self._place_singly(rdt_sequence, ft_sequence, host_time_ns)
        steps = np.diff(rdt_sequence, prepend=np.uint32(newest.rdt_sequence))
        ticks = np.diff(ft_sequence, prepend=np.uint32(newest.ft_sequence))
        if (steps != 1).any() or (ticks > MAX_TICKS_PER_RECORD).any():
            return self._place_singly(rdt_sequence, ft_sequence, host_time_ns)
        n = len(rdt_sequence)
        index = np.arange(n)
        placement = Placement(
            index, newest.counter + 1 + index, newest.tick + np.cumsum(ticks, dtype=np.int64)
        )
        self._newest = _Position(
            rdt_sequence=int(rdt_sequence[-1]),
            ft_sequence=int(ft_sequence[-1]),
            counter=newest.counter + n,
            tick=int(placement.tick[-1]),
            host_time_ns=int(host_time_ns[-1]),
        )
        self._suspect = None
        self._ticks_per_record = int(ticks[-1])
        self._received += n
        return placement

    def _place_singly(
        self, rdt_sequence: NDArray[np.uint32], ft_sequence: NDArray[np.uint32], host_time_ns: IntArray
    ) -> Placement:
        kept = []
        records = zip(rdt_sequence.tolist(), ft_sequence.tolist(), host_time_ns.tolist(), strict=True)
        for index, (rdt, ft, stamp_ns) in enumerate(records):
            position = self._place_one(rdt, ft, stamp_ns)
            if position is not None:
                kept.append((index, position.counter, position.tick))
        self._received += len(kept)
        return Placement(*np.array(kept, np.int64).reshape(-1, 3).T)

    def _place_one(self, rdt: int, ft: int, stamp_ns: int) -> _Position | None:
        confirmed = self._follows_suspect(rdt, ft)
        start_expected = self._start_requested and 1 <= rdt <= TRUSTED_STEP
        newest = self._newest
        if newest is not None:
            step = _signed(rdt - newest.rdt_sequence)
            ticks = _signed(ft - newest.ft_sequence)
            if _fit(step, ticks) and (confirmed or self._trusted(step, ticks)):
                position = _Position(rdt, ft, newest.counter + step, newest.tick + ticks, stamp_ns)
                if step > 0:
                    return self._advance(newest, position, confirmed)
                if self._gaps.fill(position.counter):
                    self._lost -= 1
                    self._late += 1
                    return position
                if step == 0 or not start_expected:
                    self._duplicated += 1
                    return None
        if rdt == 1 or start_expected:
            return self._begin(rdt, ft, stamp_ns, first=1)
        if confirmed and self._suspect is not None:
            self._strange -= 1
            return self._begin(rdt, ft, stamp_ns, first=self._suspect[0])
        self._suspect = (rdt, ft)
        self._strange += 1
        return None

    def _trusted(self, step: int, ticks: int) -> bool:
        """Tell whether a record so far from the newest one may be used without a second one that confirms it."""
        if abs(step) <= _NEIGHBOURS or self._ticks_per_record is None:
            return abs(step) <= TRUSTED_STEP
        expected = step * self._ticks_per_record
        return abs(step) <= TRUSTED_STEP and abs(ticks - expected) <= abs(expected) // 100

    def _follows_suspect(self, rdt: int, ft: int) -> bool:
        if self._suspect is None:
            return False
        step = _signed(rdt - self._suspect[0])
        return 0 < step <= TRUSTED_STEP and _fit(step, _signed(ft - self._suspect[1]))

    def _advance(self, newest: _Position, position: _Position, confirmed: bool) -> _Position:
        if confirmed:  # the suspect was a record of this stream; it was not delivered
            self._strange -= 1
        missing = position.counter - newest.counter - 1
        if not missing:
            self._ticks_per_record = position.tick - newest.tick
        self._lost += missing
        self._gaps.add(newest.counter + 1, position.counter)
        self._newest, self._suspect = position, None
        return position

    def _begin(self, rdt: int, ft: int, stamp_ns: int, first: int) -> _Position:
        """Begin a stream whose first record was ``first``; the counter goes on after the former stream."""
        newest = self._newest
        counter, tick = 0, ft
        if newest is not None:
            self._restarts += 1
            counter = newest.counter
            tick = self._tick_across(newest, ft, stamp_ns)
        missing = (rdt - first) % 2**32
        position = _Position(rdt, ft, counter + missing + 1, tick, stamp_ns)
        self._ticks_per_record = None
        self._gaps.clear()
        self._gaps.add(counter + 1, position.counter)
        self._lost += missing
        self._newest, self._suspect, self._start_requested = position, None, False
        return position

    def _tick_across(self, newest: _Position, ft: int, stamp_ns: int) -> int:
        """Return the tick of the first record of another stream: 0 where the box was powered up in between."""
        ticks = _signed(ft - newest.ft_sequence)
        expected = (stamp_ns - newest.host_time_ns) * self._ticks_per_ns
        tolerance = _CLOCK_TOLERANCE_S * 1e9 * self._ticks_per_ns
        same_clock = ticks >= 0 and abs(ticks - expected) <= tolerance
        return newest.tick + ticks if same_clock else 0


def _signed(difference: int) -> int:
    """Interpret a difference of two 32-bit counters as a step of less than half their range."""
    return (difference + 2**31) % 2**32 - 2**31


def _fit(step: int, ticks: int) -> bool:
    """Tell whether a step of records and a step of ticks can belong to one stream."""
    if step < 0:
        step, ticks = -step, -ticks
    return 0 <= ticks <= step * MAX_TICKS_PER_RECORD
