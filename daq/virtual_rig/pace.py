"""How fast the time of the virtual laboratory runs: as the computer's, unless something in it falls behind.

A phantom that is not solved yet, a controller whose cycles are late, an image that nobody has taken: each holds the
laboratory's clock until it has caught up. All devices live on that clock, and who records them too, so what is recorded
is right however slow the computer is; it only takes longer.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from robot_drivers.closing import ClosedAtExit
from robot_drivers.laboratory_clock import ClockKeeper

_LOOK_S = 0.004
_AHEAD_NS = 30_000_000
_READERS_BEHIND_S = 0.15


@dataclass(frozen=True, slots=True)
class Follower:
    """Something that must keep up: how far it is behind, s, and how far it may be without harm."""

    behind_s: Callable[[], float]
    allowed_s: float

    @property
    def keeps_up(self) -> bool:
        """Whether it is no further behind than it may be."""
        return self.behind_s() <= self.allowed_s


class Pace(ClosedAtExit):
    """Holds the clock until :meth:`follow`, and from then on whenever a follower is behind; a context manager."""

    def __init__(self, keeper: ClockKeeper) -> None:
        self._keeper = keeper
        self._followers: Sequence[Follower] | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="laboratory-pace")
        self._thread.start()

    def follow(self, followers: Sequence[Follower]) -> None:
        """Let time run as long as these keep up, and those who read the devices."""
        self._followers = (*followers, Follower(self._keeper.readers_behind_s, _READERS_BEHIND_S))

    def close(self) -> None:
        """Grant no more time."""
        self._stopping.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stopping.wait(_LOOK_S):
            followers = self._followers
            if followers is not None and all(follower.keeps_up for follower in followers):
                self._keeper.grant(_AHEAD_NS)
            else:
                self._keeper.hold()
