"""What client and acquisition process say to each other; each message is pickled by itself.

Both ends are the same program, so pickle is safe here; ``VERSION`` tells programs of different age apart.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.recording.folder import SessionInfo
from daq.rig import Rig
from daq.session.session import Label
from daq.trajectories import Trajectory
from robot_drivers.ati.compensation.tare import Tare
from robot_drivers.protocols import DeviceIdentity, FloatArray

VERSION = 4


@dataclass(frozen=True, slots=True)
class Open:
    """Connect the devices of this rig; the first message of a client."""

    rig: Rig
    version: int = VERSION


@dataclass(frozen=True, slots=True)
class Start:
    """Begin a session."""

    trajectory: Trajectory
    folder: Path
    label: Label


@dataclass(frozen=True, slots=True)
class Check:
    """Check a trajectory from where the robot stands, as a session would before anything moves. Nothing moves."""

    trajectory: Trajectory


@dataclass(frozen=True, slots=True)
class TakeTare:
    """Take the force sensor's last second for zero. What is recorded stays as it is read."""


@dataclass(frozen=True, slots=True)
class Look:
    """Ask for the next images of one moment, of both cameras or the only one, at full size."""


@dataclass(frozen=True, slots=True)
class Hold:
    """Hold the robot at once; a session under way ends with this reason."""

    reason: str


@dataclass(frozen=True, slots=True)
class Release:
    """Let a robot that was held move again: a person has looked at the cell and says so. Nothing moves by itself."""


@dataclass(frozen=True, slots=True)
class Note:
    """Record what the operator has to say."""

    text: str


@dataclass(frozen=True, slots=True)
class Mark:
    """Mark the session under way, if there is one, with a problem that the client knows of."""

    problem: str


@dataclass(frozen=True, slots=True)
class Alive:
    """The client is there.

    Attributes
    ----------
    threads : native ids of its threads on which the next sign of life depends; empty where it does not tell
    """

    threads: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Close:
    """Hold a robot that moves, end, and close the devices."""


Command = Open | Start | Check | TakeTare | Look | Hold | Release | Note | Mark | Alive | Close


@dataclass(frozen=True, slots=True)
class Opened:
    """The devices are connected; who they are, by their roles."""

    devices: Mapping[str, DeviceIdentity]
    version: int = VERSION


@dataclass(frozen=True, slots=True)
class StreamCounts:
    """What became of the samples of one stream.

    Attributes
    ----------
    received, lost : by the device's own counter, since it began to stream
    written : are in the file of the session and survive the death of the process
    dropped : were received and are not in the file; more than 0 marks the session
    age_s : of the newest sample
    sync_s : how well the device's clock is known on the host's; NaN where it has none or is too new
    """

    received: int
    lost: int
    written: int
    dropped: int
    age_s: float
    sync_s: float


@dataclass(frozen=True, slots=True)
class Telemetry:
    """What the process is doing, and what the devices brought since the last telemetry.

    Attributes
    ----------
    time_ns : host clock
    state : in words
    step, steps : how many of how many of the session's steps are done
    session : folder of the session, None without one
    held : why the robot is held, empty while it is not
    counts : of each stream by its name
    force : (n, 7) host time in s, wrench in N and N·m; at most 200 rows a second
    pose : (n, 8) host time in s, position in m, quaternion with the scalar first
    images : the latest of each camera, at a quarter of its size, where there is a new one
    zero : (6,) what the guard takes for no load, N and N·m, sensor frame; None while it does not guard
    problems : what the running session is going to be marked with, as far as that is known
    """

    time_ns: int
    state: str
    step: int
    steps: int
    session: Path | None
    held: str
    counts: Mapping[str, StreamCounts]
    force: FloatArray
    pose: FloatArray
    images: Mapping[str, NDArray[np.uint8]]
    zero: FloatArray | None
    problems: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Failure:
    """An error, by the name of its class and its one line."""

    kind: str
    message: str


@dataclass(frozen=True, slots=True)
class Ended:
    """A session has ended: what its folder says (None where there is none), and what went wrong (None if nothing)."""

    info: SessionInfo | None
    failure: Failure | None


@dataclass(frozen=True, slots=True)
class Refused:
    """A command was not carried out."""

    failure: Failure


@dataclass(frozen=True, slots=True)
class Checked:
    """What the check of a trajectory says; ``failure`` is None where the robot may carry it out."""

    trajectory: Trajectory
    failure: Failure | None


@dataclass(frozen=True, slots=True)
class Tared:
    """A zero for the force sensor."""

    tare: Tare


@dataclass(frozen=True, slots=True)
class Seen:
    """Images of one moment, by name, left one first or the only one, and that moment on the host clock."""

    images: Mapping[str, NDArray[np.uint8]]
    pixel_format: str
    time_ns: int


Report = Opened | Telemetry | Ended | Refused | Checked | Tared | Seen
