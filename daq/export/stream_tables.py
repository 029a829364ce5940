"""A recording as tables: one for each stream, and the synchronised one; every column with its unit."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.recording.reader import Recording
from daq.recording.stored_streams import Images
from daq.synchronisation.stream_times import clock_times
from daq.timing.event_times import EventTimes, estimate_event_times
from estimator.experiment import Experiment
from robot_drivers.protocols import FloatArray, IntArray, PoseBlock, WrenchBlock

_WRENCH = (("fx", "N"), ("fy", "N"), ("fz", "N"), ("tx", "N m"), ("ty", "N m"), ("tz", "N m"))
_POSE = (("px", "m"), ("py", "m"), ("pz", "m"), ("qw", "1"), ("qx", "1"), ("qy", "1"), ("qz", "1"))


@dataclass(frozen=True, slots=True)
class Column:
    """Values (n,) of one quantity; ``unit`` is "1" for a number without one."""

    name: str
    unit: str
    values: NDArray[Any]


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of equal length under one name."""

    name: str
    columns: tuple[Column, ...]

    def __len__(self) -> int:
        return len(self.columns[0].values)


def stream_tables(recording: Recording) -> Iterator[Table]:
    """Yield the tables ``force``, ``robot``, ``camera_<name>`` and ``events`` of a recording.

    Raw stamps are given as they were recorded; ``time`` is the estimate on the host clock, NaN for a stream of fewer
    than two samples. All times but the device's count from the first receive stamp of the force sensor. Of the images
    the stamps alone are given.
    """
    force, robot = recording.force, recording.robot
    origin_ns = int(force.host_time_ns[0]) if len(force) else recording.info.clock_anchor.host_time_ns
    usable = Column("usable", "1", force.usable.astype(np.uint8))
    yield Table(
        "force",
        (
            *_stamps(force, partial(estimate_event_times, force.counter), origin_ns),
            Column("status", "1", force.status),
            usable,
            *_columns(_WRENCH, force.wrench),
        ),
    )
    yield Table(
        "robot",
        (
            *_stamps(robot, partial(clock_times, robot.device_time_s, counter=robot.counter), origin_ns),
            Column("moving", "1", robot.moving.astype(np.uint8)),
            *_columns(_POSE, np.hstack([robot.position, robot.quaternion_wxyz])),
            *_columns([(f"joint_{n}", "rad") for n in range(1, robot.joints.shape[1] + 1)], robot.joints),
        ),
    )
    for name in recording.cameras:
        images = recording.images(name)
        map_clock = partial(clock_times, images.device_time_s, counter=images.counter)
        yield Table(f"camera_{name}", _stamps(images, map_clock, origin_ns))
    events = recording.events
    yield Table(
        "events",
        (
            Column("host_time", "s", _since([event.time_ns for event in events], origin_ns)),
            Column("event", "text", np.array([event.name for event in events], dtype=np.str_)),
            Column("details", "text", np.array([str(event.details) for event in events], dtype=np.str_)),
        ),
    )


def synchronised_table(experiment: Experiment) -> Table:
    """Return the rows of an experiment, in the columns of its folder's ``observations.csv``."""
    fiducials = [(f"m{n:02d}{axis}", "m") for n in range(len(experiment.fiducials_rest)) for axis in "xyz"]
    return Table(
        "synchronised",
        (
            Column("time", "s", experiment.time),
            Column("phase", "text", np.array(experiment.phase, dtype=np.str_)),
            Column("step", "1", experiment.step),
            *_columns(_POSE, np.hstack([experiment.position, experiment.quaternion_wxyz])),
            *_columns(_WRENCH, experiment.wrench),
            *_columns(fiducials, experiment.fiducials.reshape(len(experiment.time), -1)),
        ),
    )


def _stamps(
    stream: WrenchBlock | PoseBlock | Images, map_clock: Callable[[IntArray], EventTimes], origin_ns: int
) -> tuple[Column, ...]:
    estimate = np.full(len(stream), np.nan)
    if len(stream) >= 2:
        estimate = _since(map_clock(stream.host_time_ns).time_ns, origin_ns)
    return (
        Column("time", "s", estimate),
        Column("host_time", "s", _since(stream.host_time_ns, origin_ns)),
        Column("device_time", "s", stream.device_time_s),
        Column("counter", "1", stream.counter),
    )


def _since(time_ns: ArrayLike, origin_ns: int) -> FloatArray:
    return np.asarray((np.asarray(time_ns, dtype=np.int64) - origin_ns) * 1e-9, dtype=np.float64)


def _columns(names: Sequence[tuple[str, str]], values: FloatArray) -> Iterator[Column]:
    for place, (name, unit) in enumerate(names):
        yield Column(name, unit, values[:, place])
