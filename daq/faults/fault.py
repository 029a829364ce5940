"""What a fault is to the campaign: what brings it about, what is right for it, and what takes it away."""

import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from daq.faults.bench import Bench
from daq.faults.clients import Client, CommandClient, WindowClient

Ends = Literal["held", "goes on"]


@dataclass(frozen=True, slots=True)
class Scene:
    """A session under way.

    Attributes
    ----------
    bench : the rig
    client : who controls the session
    session : its folder
    chance : draws what a fault leaves open, the same for the same seed and run
    """

    bench: Bench
    client: Client
    session: Path
    chance: random.Random


Act = Callable[[Scene], None]


def nothing(scene: Scene) -> None:
    """Leave all as it is."""


@dataclass(frozen=True, slots=True)
class Expectation:
    """What must be true after a fault.

    Attributes
    ----------
    ends : whether the robot must be held, or the session must go on to its end
    within_s : after the fault the tool must not move later than this, by the log of the emulated arm
    reason : pattern that the one line must contain in which the cause is told; "" where nothing needs to be told
    marked : whether the recording must tell an analyst that something happened
    resets : streams whose clock must be found to have begun anew, by their names in the session's report; no other may
    """

    ends: Ends
    within_s: float = 0.0
    reason: str = ""
    marked: bool = True
    resets: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault.

    Attributes
    ----------
    label : its name in the table, on the command line and in the results
    right : what is right for it, and why, in a sentence or two
    expected : the same for the checks
    strike : brings it about, at once
    mend : takes it away, once the session has ended
    from_s : how long after the beginning of the recording it comes at the earliest: a clock must have been seen to jump
    tells_s : how long before the session's nominal end it comes at the latest: a fault that nobody can have noticed yet
        when the recording ends has not befallen it
    client : who controls the session
    """

    label: str
    right: str
    expected: Expectation
    strike: Act
    mend: Act = nothing
    from_s: float = 0.0
    tells_s: float = 0.3
    client: type[WindowClient] | type[CommandClient] = WindowClient
