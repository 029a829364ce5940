"""Means over the measuring windows of a recording, and the scatter that those means have."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.errors import SynchronisationError
from daq.recording.events import MEASURE_BEGIN, MEASURE_END
from daq.recording.stored_streams import Event
from daq.timing.event_times import EventTimes
from robot_drivers.protocols import FloatArray

UNDER_WAY = 2**62
"""An end that has not come yet, ns."""

_PARTS = 4
_ENOUGH = 0.5  # of the samples that a window ought to have


@dataclass(frozen=True, slots=True)
class Window:
    """One measuring window: the row it becomes, and its ends on the host clock, ns."""

    number: int
    phase: str
    begin_ns: int
    end_ns: int

    @property
    def middle_ns(self) -> int:
        """The time that its means belong to."""
        return (self.begin_ns + self.end_ns) // 2


def measuring_windows(events: Sequence[Event]) -> list[Window]:
    """Return the windows that were measured to their end, the first of them at rest.

    Raises
    ------
    SynchronisationError
        The session ended before its first window did.
    """
    windows = [window for window in windows_begun(events) if window.end_ns != UNDER_WAY]
    if not windows or windows[0].number != 0:
        raise SynchronisationError(
            "the recording has no complete window at rest; record the retraction again"
        )
    return windows


def windows_begun(events: Sequence[Event]) -> list[Window]:
    """Return the windows that were begun; one that was not measured to its end ends at :data:`UNDER_WAY`."""
    ends = {event.details["row"]: event.time_ns for event in events if event.name == MEASURE_END}
    return [
        Window(
            event.details["number"],
            event.details["phase"],
            event.time_ns,
            ends.get(event.details["row"], UNDER_WAY),
        )
        for event in events
        if event.name == MEASURE_BEGIN
    ]


def in_window(times: EventTimes, window: Window) -> NDArray[np.bool_]:
    """Tell for every sample of a stream whether it was taken in the window."""
    return (times.time_ns >= window.begin_ns) & (times.time_ns <= window.end_ns)


@dataclass(frozen=True, slots=True)
class Means:
    """One mean for every window.

    Attributes
    ----------
    mean : (n, ...) NaN where there were too few samples
    scatter : (n, ...) standard deviation of the mean, NaN where it cannot be told
    count : samples in each window
    """

    mean: FloatArray
    scatter: FloatArray
    count: tuple[int, ...]

    def pooled_scatter(self, *components: int) -> float:
        """Return the root mean square scatter over all windows and, where given, these components of the last axis."""
        scatter = self.scatter[..., list(components)] if components else self.scatter
        known = scatter[np.isfinite(scatter)]
        return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def window_means(samples: FloatArray, times: EventTimes, windows: Sequence[Window], stream: str) -> Means:
    """Average samples (n, ...) of a stream over windows; samples with a NaN are left out.

    Raises
    ------
    SynchronisationError
        The first window, at rest, has too few samples.
    """
    means: list[FloatArray] = []
    scatters: list[FloatArray] = []
    counts: list[int] = []
    usable = np.isfinite(samples.reshape(len(samples), -1)).all(axis=1)
    for window in windows:
        inside = samples[usable & in_window(times, window)]
        expected = (window.end_ns - window.begin_ns) * 1e-9 / times.period_s
        if len(inside) < max(1.0, _ENOUGH * expected):
            if not means:
                raise SynchronisationError(
                    f"the {stream} has {len(inside)} of {expected:.0f} samples in the window at rest; "
                    "record the retraction again"
                )
            means.append(np.full(samples.shape[1:], np.nan))
            scatters.append(np.full(samples.shape[1:], np.nan))
        else:
            means.append(inside.mean(axis=0))
            scatters.append(scatter_of_mean(inside))
        counts.append(len(inside))
    return Means(np.array(means), np.array(scatters), tuple(counts))


def scatter_of_mean(samples: FloatArray) -> FloatArray:
    """Return the standard deviation (...) of the mean of consecutive samples (n, ...).

    It comes from the means of four parts of the window, so that slow noise, of which neighbours share the most part,
    is not taken for white. NaN where there are too few samples.
    """
    if len(samples) < 2 * _PARTS:
        return np.full(samples.shape[1:], np.nan)
    parts = np.array([part.mean(axis=0) for part in np.array_split(samples, _PARTS)])
    return np.asarray(parts.std(axis=0, ddof=1) / np.sqrt(_PARTS))
