"""Keeping account of a numbered stream: unwrapped counters, and what was lost, doubled or late."""

import dataclasses

from robot_drivers.protocols import StreamStatistics

_SPAN = 1 << 32
_LONGEST_MEMORY = 4096  # missing numbers kept to recognise late arrivals
_REBOOT_S = 10.0  # no datagram is this late; a clock that falls back further has started anew


class SequenceAccount:
    """The numbering of one stream of messages with uint32 sequence numbers.

    A smaller number with a later device clock, or with one that fell back by more than 10 s, is a new
    session of the sender: it counts as a restart and the counter goes on by one. What comes late of a session that
    has ended counts as malformed: its number means another place now.
    """

    def __init__(self) -> None:
        self._statistics = StreamStatistics()
        self._missing: dict[int, None] = {}
        self._newest: int | None = None
        self._newest_time_s = 0.0
        self._session_begin_s = 0.0
        self._offset = 0

    @property
    def statistics(self) -> StreamStatistics:
        """The counts so far."""
        return self._statistics

    def malformed(self) -> None:
        """Count a message that could not be read or came from a stranger."""
        self._add(malformed=1)

    def accept(self, number: int, device_time_s: float) -> int | None:
        """Return the unwrapped counter of a message, None for one that was there before."""
        if self._newest is None:
            self._session_begin_s = device_time_s
            return self._advance(number, device_time_s, received=1)
        ahead = (number + self._offset - self._newest + _SPAN // 2) % _SPAN - _SPAN // 2
        rebooted = device_time_s < self._newest_time_s - _REBOOT_S
        if not rebooted and self._of_former_session(ahead, device_time_s):
            self._add(malformed=1)
            return None
        if ahead > 0 and not rebooted:
            self._remember_missing(self._newest + 1, self._newest + ahead)
            return self._advance(self._newest + ahead, device_time_s, received=1, lost=ahead - 1)
        if rebooted or device_time_s > self._newest_time_s:
            self._missing.clear()
            self._session_begin_s = device_time_s
            self._offset = self._newest + 1 - number
            return self._advance(self._newest + 1, device_time_s, received=1, restarts=1)
        counter = self._newest + ahead
        if counter not in self._missing:
            self._add(duplicated=1)
            return None
        del self._missing[counter]
        self._add(received=1, late=1, lost=-1)
        return counter

    def _of_former_session(self, ahead: int, device_time_s: float) -> bool:
        """Tell whether number and clock contradict each other, or the session began after the message."""
        began_after = self._statistics.restarts > 0 and device_time_s < self._session_begin_s
        return began_after or (ahead > 0 and device_time_s < self._newest_time_s)

    def _advance(self, counter: int, device_time_s: float, **counts: int) -> int:
        self._newest, self._newest_time_s = counter, device_time_s
        self._add(**counts)
        return counter

    def _remember_missing(self, first: int, end: int) -> None:
        self._missing.update(dict.fromkeys(range(max(first, end - _LONGEST_MEMORY), end)))
        while len(self._missing) > _LONGEST_MEMORY:
            del self._missing[next(iter(self._missing))]

    def _add(self, **counts: int) -> None:
        sums = {name: getattr(self._statistics, name) + count for name, count in counts.items()}
        self._statistics = dataclasses.replace(self._statistics, **sums)
