"""How fast the time of the virtual laboratory runs: as the computer's, unless something in it falls behind.

A phantom that is not solved yet, a controller whose cycles are late, an image that nobody has taken: each holds the
laboratory's clock until it has caught up. All devices live on that clock, and who records them too, so what is recorded
is right however slow the computer is; it only takes longer.
"""

import threading
from collections.abc import Callable, Sequence
from typing import TypeAlias

from robot_drivers.closing import ClosedAtExit
from robot_drivers.laboratory_clock import ClockKeeper

_LOOK_S = 0.004
_AHEAD_S = 0.03
_READERS_BEHIND_S = 0.15


Room: TypeAlias = Callable[[], float]
"""For how long, s, time may run on before something is too far behind; at most zero where it is already."""


def lateness(behind_s: Callable[[], float], allowed_s: float) -> Room:
    """Return the room of something that is so far behind, s, where it may be as far as that without harm."""
    return lambda: allowed_s - behind_s()


class Pace(ClosedAtExit):
    """Holds the clock until :meth:`follow`, and from then on whenever somebody is behind; a context manager."""

    def __init__(self, keeper: ClockKeeper) -> None:
        self._keeper = keeper
        self._rooms: Sequence[Room] | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="laboratory-pace")
        self._thread.start()

    def follow(self, rooms: Sequence[Room]) -> None:
        """Let time run as far as these have room for it, and those who read the devices."""
        self._rooms = (*rooms, lateness(self._keeper.readers_behind_s, _READERS_BEHIND_S))

    def close(self) -> None:
        """Grant no more time."""
        self._stopping.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stopping.wait(_LOOK_S):
            rooms = self._rooms
            room_s = 0.0 if rooms is None else min(_AHEAD_S, *(room() for room in rooms))
            if room_s > 0.0:
                self._keeper.grant(int(1e9 * room_s))
            else:
                self._keeper.hold()
