"""What the window says to the operator: what happened, what is safe now, and what to do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from daq.acquisition.failures import Failure
from daq.errors import MotionLimitError, RecordingError, SessionError, SoftwareStopError, TrajectoryError
from robot_drivers.ati.compensation.tare import TareRefusedError
from robot_drivers.errors import MotionRefusedError

Severity = Literal["information", "warning", "error"]


@dataclass(frozen=True, slots=True)
class Message:
    """A message in plain words.

    Attributes
    ----------
    what : happened
    safe : what is safe now, such as "The robot stands, the recording is sealed."; empty where nothing was at stake
    do : what to do next; empty where nothing needs to be done
    details : for whoever is asked for help, to be copied
    """

    severity: Severity
    what: str
    safe: str = ""
    do: str = ""
    details: str = ""

    def as_text(self) -> str:
        """Return everything, to be copied."""
        return "\n".join(filter(None, (self.what, self.safe, self.do, self.details)))


def information(what: str, do: str = "") -> Message:
    """Return something good to know."""
    return Message("information", what, do=do)


def problem_told(problem: str) -> Message:
    """Return what a problem of the recording under way means for the operator."""
    return Message(
        "warning",
        f"The recording has a problem: {problem}.",
        "It goes on, and is marked with that in its folder and in the list of sessions.",
        "Record again if these samples matter.",
    )


def recorded_told(name: str, problems: Sequence[str], notes: Sequence[str]) -> Message:
    """Return that a session is recorded and sealed, what it is marked with, and what else there is to know of it."""
    told = " ".join(
        [f"{name} is recorded and sealed.", *(f"{note[:1].upper()}{note[1:]}." for note in notes)]
    )
    if not problems:
        return information(told)
    return Message(
        "warning", f"{told} It is marked with: {'; '.join(problems)}.", do="Look at it on the page Sessions."
    )


def failure_told(failure: Failure) -> Message:
    """Return what a failure of the laboratory means for the operator."""
    nearest = next((kind for kind in failure.kind.__mro__ if kind in _MEANINGS), None)
    what, safe, do = _OTHERWISE if nearest is None else _MEANINGS[nearest]
    details = f"{failure.kind.__name__}: {failure.message}"
    return Message("error", f"{what}: {failure.message}", safe, do, details)


_STANDS = "The robot stands, and what was recorded is sealed."
_NOT_MOVED = "Nothing has moved."
_MEANINGS: Mapping[type, tuple[str, str, str]] = {
    SoftwareStopError: (
        "The software stop has held the robot",
        _STANDS,
        "Look at the cell, then release the robot.",
    ),
    MotionLimitError: ("The trajectory was refused", _NOT_MOVED, "Change the parameter that is named."),
    MotionRefusedError: ("The robot cannot reach that", _NOT_MOVED, "Change the step that is named."),
    TrajectoryError: ("The trajectory cannot be right", _NOT_MOVED, "Change the parameter that is named."),
    TareRefusedError: ("No tare was taken", "The zero is as it was before.", "Wait until nothing moves."),
    RecordingError: (
        "The recording has failed",
        "The robot stands; what was written is not lost.",
        "Make room on the disk, then repair the session on the page Sessions.",
    ),
    SessionError: (
        "The rig does not do that",
        "The robot stands.",
        "Do what the message says, then try again.",
    ),
}
_OTHERWISE = (
    "A device has failed",
    "The robot is held or stands by its own watchdog.",
    "Check cable and power.",
)
