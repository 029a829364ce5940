"""The clock of an emulated laboratory: as fast as the computer's, or slower where the emulators would not keep up.

Its keeper, a thread beside the emulators, grants a little time at a time. The clock runs at the computer's rate to the
end of what is granted and stands there until more is, so it also stands where the keeper itself gets no processor. All
processes that live in the laboratory, the recorder's too, read one file that they have mapped into their memory; so to
them the laboratory is never late, however busy the computer is.

The file holds stretches of (monotonic time, laboratory time, end of it), ns: from the first instant on, laboratory time
runs from the second to the third. The newest stretch is lengthened by what is granted; where the clock stood, another
one follows. The last stretches are kept, so that a past instant can be told too. Behind them is how far each thread has
come that reads a device, for the keeper waits for these too: no buffer overflows because a recorder is late.
"""

import mmap
import os
import threading
from pathlib import Path

import numpy as np

from robot_drivers.clock import MonotonicClock, Reader, monotonic_time_ns
from robot_drivers.errors import ConfigurationError
from robot_drivers.protocols import IntArray

_MAGIC = 0x5245_5452_434C_4B33
# cells: when the keeper was heard, its process, when somebody noticed its silence, stretches so far, the first of them
_HEARD, _KEEPER, _NOTICED, _COUNT, _FIRST = 1, 2, 3, 4, 5
_KEPT = 256
# cells of each reader: when it was heard (monotonic), how far it has come, its process
_READERS, _MOST_READERS = _FIRST + 3 * _KEPT, 16
_CELLS = _READERS + 3 * _MOST_READERS
_READER_PLACES = range(_READERS, _CELLS, 3)
_READER_GONE_NS = 10_000_000_000
_PROC = Path("/proc/self")
_KEEPER_GONE_NS = 10_000_000_000
_KEEPER_ENDED_NS = 1_000_000_000
# Where the whole computer stood still, nobody was heard; whoever is there speaks again within this time.
_CHANCE_NS = 1_000_000_000


class LaboratoryClock:
    """A laboratory's clock, read from its file; a :class:`robot_drivers.clock.HostClock`.

    A laboratory whose keeper has not been heard for ten seconds, nor within one since somebody noticed that, has died;
    one second is enough where its process has ended. Its clock then goes on as the computer's does, so that who lives
    on it notices what else has died.

    Raises
    ------
    ConfigurationError
        There is no such file, or it is another.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        try:
            with path.open("r+b") as file:
                self._cells = memoryview(mmap.mmap(file.fileno(), 8 * _CELLS)).cast("q")
        except (OSError, ValueError) as error:
            raise ConfigurationError(
                f"{path}: is no clock of an emulated laboratory ({error}); that laboratory has ended, start it anew"
            ) from error
        if self._cells[0] != _MAGIC:
            raise ConfigurationError(f"{path}: is no clock of an emulated laboratory; name its rig file")

    def time_ns(self) -> int:
        """Return the laboratory's time now, ns."""
        now_ns = monotonic_time_ns()
        cells = self._cells
        place = _place(cells[_COUNT] - 1)
        begin_ns, shown_ns, end_ns = cells[place], cells[place + 1], cells[place + 2]
        return min(shown_ns + max(0, now_ns - begin_ns), end_ns + self._alone_ns(now_ns))

    def _alone_ns(self, now_ns: int) -> int:
        """Return for how long the keeper has been gone."""
        cells = self._cells
        heard_ns = cells[_HEARD]
        silent_ns = now_ns - heard_ns
        if silent_ns > _KEEPER_ENDED_NS and _has_ended(cells[_KEEPER]):
            return silent_ns - _KEEPER_ENDED_NS
        if silent_ns <= _KEEPER_GONE_NS:
            return 0
        if cells[_NOTICED] < heard_ns:
            cells[_NOTICED] = now_ns
        return max(0, now_ns - max(heard_ns + _KEEPER_GONE_NS, cells[_NOTICED] + _CHANCE_NS))

    def times_ns(self, monotonic_ns: IntArray) -> IntArray:
        """Return what it showed (n,) at past instants of the computer's clock, of about the last second at least."""
        count = self._cells[_COUNT]
        places = [_place(number) for number in range(max(0, count - _KEPT + 1), count)]
        stretches = np.array([self._cells[place : place + 3].tolist() for place in places])
        of_each = np.maximum(np.searchsorted(stretches[:, 0], monotonic_ns, side="right") - 1, 0)
        begin_ns, shown_ns, end_ns = stretches[of_each].T
        return np.minimum(shown_ns + np.maximum(monotonic_ns - begin_ns, 0), end_ns)

    def reader(self) -> Reader:
        """Return a reader that has come as far as now; one too many is not waited for."""
        cells = self._cells
        with self._lock:
            free = [place for place in _READER_PLACES if not cells[place]]
            reader = LaboratoryReader(cells, free[0]) if free else MonotonicClock().reader()
            reader.caught_up(self.time_ns())
        return reader


class LaboratoryReader:
    """A thread that reads a device of the laboratory; see :class:`robot_drivers.clock.Reader`."""

    def __init__(self, cells: memoryview, place: int) -> None:
        self._cells = cells
        self._place = place

    def caught_up(self, time_ns: int) -> None:
        """Say that all that came before this time has been dealt with."""
        self._cells[self._place + 1], self._cells[self._place + 2] = time_ns, os.getpid()
        self._cells[self._place] = monotonic_time_ns()

    def close(self) -> None:
        """Say that it reads no more."""
        self._cells[self._place] = 0


class ClockKeeper(LaboratoryClock):
    """Makes a laboratory's clock, and says how far it may run; one thread owns it."""

    def __init__(self, path: Path) -> None:
        now_ns = monotonic_time_ns()
        cells = np.zeros(_CELLS, np.int64)
        cells[: _FIRST + 3] = _MAGIC, now_ns, os.getpid(), 0, 1, now_ns, now_ns, now_ns
        path.write_bytes(cells.tobytes())
        self._noticed_ns: dict[int, int] = {}
        super().__init__(path)

    def grant(self, ahead_ns: int) -> None:
        """Let the clock run on for so long from now."""
        cells = self._cells
        now_ns, shown_ns = monotonic_time_ns(), self.time_ns()
        place = _place(cells[_COUNT] - 1)
        if shown_ns < cells[place + 2]:
            cells[place + 2] = max(cells[place + 2], shown_ns + ahead_ns)
        else:
            place = _place(cells[_COUNT])
            cells[place], cells[place + 1], cells[place + 2] = now_ns, shown_ns, shown_ns + ahead_ns
            cells[_COUNT] += 1
        cells[_HEARD] = now_ns

    def hold(self) -> None:
        """Let the clock stand at the end of what was granted."""
        if self.time_ns() > self._cells[_place(self._cells[_COUNT] - 1) + 2]:
            self.grant(0)  # it went on by itself, and does not go back
        self._cells[_HEARD] = monotonic_time_ns()

    def readers_behind_s(self) -> float:
        """Return how far the last of the readers is behind, s; 0 without any.

        One whose process has ended is not waited for, nor one that has not been heard for ten seconds and for one since
        that was noticed: it is stopped.
        """
        cells, come_ns = self._cells, []
        for place in _READER_PLACES:
            if not cells[place]:
                continue
            if self._is_gone(place):
                cells[place] = 0  # its place is another's
            else:
                come_ns.append(cells[place + 1])
        return 0.0 if not come_ns else (self.time_ns() - min(come_ns)) * 1e-9

    def _is_gone(self, place: int) -> bool:
        heard_ns, now_ns = self._cells[place], monotonic_time_ns()
        if _has_ended(self._cells[place + 2]):
            return True
        if now_ns - heard_ns <= _READER_GONE_NS:
            return False
        if self._noticed_ns.get(place, 0) < heard_ns:
            self._noticed_ns[place] = now_ns
        return now_ns - self._noticed_ns[place] > _CHANCE_NS


def _has_ended(process_id: int) -> bool:
    """Tell whether a process is no more, or only its parent has not asked yet how it ended; where it can be told."""
    try:
        told = Path(f"/proc/{process_id}/stat").read_text(encoding="ascii", errors="replace")
    except (FileNotFoundError, ProcessLookupError):  # the latter where it ends between opening and reading
        return _PROC.is_dir()
    return told.rpartition(")")[2].split()[0] in "ZX"


def _place(number: int) -> int:
    return _FIRST + 3 * (number % _KEPT)
