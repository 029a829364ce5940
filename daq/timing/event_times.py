"""When the samples of a stream were taken, on the host clock.

The device's counter (of a periodic device) or clock is the better clock, the host's receive stamp the common one.
Windows of a minute follow the wander of the clocks; between their centres the lines are blended. What no one-way
method can see is the constant least delay of the transport, which stays in the result.

A clock in seconds is known beforehand to run at about one second a second. A counter is not: nobody knows its rate to
better than some per cent. So a camera, which sends few and late messages, is mapped by its clock, and a force sensor
by its counter.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from daq.errors import SynchronisationError
from daq.timing.envelope import FloatArray, lower_envelope, lower_envelope_near
from robot_drivers.protocols import IntArray

WINDOW_S = 60.0
_RESIDUAL_QUANTILES = (0.5, 0.95, 0.999, 1.0)
_GAP_PERIODS = 1.5
_LATE_SAMPLES = 16  # what was overtaken comes before so many others; a clock that began anew stays behind
_LEAP_NS = 50e6  # a clock that gains so much from one sample to the next has been set
_CRYSTAL = 20e-6  # how far the rates of two crystals are apart on average; some are by 100 ppm


@dataclass(frozen=True, slots=True)
class EventTimes:
    """Estimated times of the samples of one stream, and how good they are.

    Attributes
    ----------
    time_ns : (n,) host clock
    period_s : the median time between samples
    gap_ends : (g,) indices of the samples before which others are missing; a restart counts as a gap
    resets : how often the device's counter or clock started anew, or leapt ahead
    residual_s : 50 %, 95 %, 99.9 % and largest delay of the receive stamps over the estimate, s
    wander_ppm : largest change of the clock's rate between windows
    """

    time_ns: IntArray
    period_s: float
    gap_ends: IntArray
    resets: int
    residual_s: tuple[float, float, float, float]
    wander_ppm: float


def estimate_event_times(
    device: FloatArray | IntArray,
    host_time_ns: IntArray,
    quantum: float = 0.0,
    unit_ns: float = math.nan,
    counter: IntArray | None = None,
) -> EventTimes:
    """Map a device's counter or clock to the host clock by the lower envelope.

    Parameters
    ----------
    device : (n,) counter or clock of the samples in the order of arrival, in any unit
    host_time_ns : (n,) receive stamps
    quantum : resolution of a clock that rounds down, in its unit; 0 for a counter
    unit_ns : what a unit of a clock with a crystal lasts by its name, ns; NaN for a counter, whose rate nobody knows
    counter : (n,) of the same samples, where ``device`` is a clock with a crystal: tells when that leaps

    Raises
    ------
    SynchronisationError
        Fewer than two samples.
    """
    if len(device) < 2:
        raise SynchronisationError(f"a stream of {len(device)} samples has no clock; record for longer")
    clock = np.asarray(device - device[0], dtype=np.float64)
    starts = clock_starts(clock, host_time_ns, unit_ns, counter)
    time_ns = np.empty(len(clock), dtype=np.int64)
    rates: list[float] = []
    for part in np.split(np.arange(len(clock)), starts):
        time_ns[part], part_rates = _map_segment(clock[part], host_time_ns[part], quantum, unit_ns)
        rates += part_rates
    residual = np.quantile(host_time_ns - time_ns, _RESIDUAL_QUANTILES) * 1e-9
    order = np.argsort(time_ns, kind="stable")  # what was overtaken stands behind its place
    steps = np.diff(time_ns[order])
    period = float(np.median(steps))
    gap_ends = np.union1d(order[1:][steps > _GAP_PERIODS * period], starts)
    return EventTimes(
        time_ns,
        period_s=period * 1e-9,
        gap_ends=gap_ends.astype(np.int64),
        resets=len(starts),
        residual_s=(float(residual[0]), float(residual[1]), float(residual[2]), float(residual[3])),
        wander_ppm=float(1e6 * (max(rates) / min(rates) - 1.0)) if rates else 0.0,
    )


def clock_starts(
    clock: FloatArray,
    host_time_ns: IntArray,
    unit_ns: float = math.nan,
    counter: IntArray | None = None,
) -> IntArray:
    """Return the indices (r,) of the samples with which a counter or clock began anew, or leapt ahead.

    A sample that was overtaken on its way falls back too, but those after it go on beyond.

    Parameters
    ----------
    clock : (n,) in the order of arrival
    host_time_ns : (n,) receive stamps
    unit_ns : what a unit lasts by its name, ns; NaN where nobody knows
    counter : (n,) beside a clock of known unit, by which a leap is told; None for none
    """
    starts = np.array([*_falls(clock)], dtype=np.int64)
    if counter is None:
        return starts
    return np.union1d(starts, _leaps(clock * unit_ns, host_time_ns, counter))


def _falls(clock: FloatArray) -> Iterator[int]:
    """Yield where a clock falls back, and stays behind.

    The last samples of a stream have none after them to show that they were overtaken; such have not fallen back far.
    """
    if len(clock) < 2:
        return
    begin = 0
    far = _LATE_SAMPLES * float(np.median(np.abs(np.diff(clock))))
    while True:
        part = clock[begin:]
        highest = np.maximum.accumulate(part)
        behind = (part < highest).astype(np.int8)
        edges = np.flatnonzero(np.diff(behind, prepend=0, append=0))
        firsts, ends = edges[::2], edges[1::2]
        fallen_far = (highest - part)[firsts] > far
        anew = firsts[(ends - firsts > _LATE_SAMPLES) | ((ends == len(part)) & fallen_far)]
        if not len(anew):
            return
        begin += int(anew[0])
        yield begin


def _leaps(clock_ns: FloatArray, host_time_ns: IntArray, counter: IntArray) -> IntArray:
    """Return where a clock in ns leaps ahead of the host's and of its own counter.

    Ahead of the host's alone is a message on time after late ones, ahead of the counter alone a device that paused.
    """
    steps, counts = np.diff(clock_ns), np.diff(counter)
    counted = counts > 0
    if not counted.any():
        return np.empty(0, dtype=np.int64)
    period_ns = float(np.median(steps[counted] / counts[counted]))
    expected = np.maximum(np.diff(host_time_ns), counts * period_ns)
    return np.flatnonzero(steps - expected > _LEAP_NS).astype(np.int64) + 1


def _map_segment(
    clock: FloatArray, host_time_ns: IntArray, quantum: float, unit_ns: float
) -> tuple[IntArray, list[float]]:
    """Map one segment without resets; returns the times and the rate (ns per unit) of each window."""
    span = clock[-1] - clock[0]
    host = (host_time_ns - host_time_ns[0]).astype(np.float64)
    if span == 0 or host[-1] == 0:
        return host_time_ns.copy(), []
    # the mean rate is taken out first, so that the envelope works on small numbers
    mean_ns = host[-1] / span
    elapsed = clock - clock[0]
    excess = host - mean_ns * elapsed
    width = min(WINDOW_S * 1e9 / mean_ns, span)
    count = max(1, int(np.ceil(2 * span / width)) - 1)
    centres = np.linspace(width / 2, span - width / 2, count)
    lines = []
    for centre in centres:
        inside = np.abs(elapsed - centre) <= width / 2
        x, y = elapsed[inside], excess[inside]
        known = math.isfinite(unit_ns)
        lines.append(
            lower_envelope_near(x, y, unit_ns - mean_ns, _CRYSTAL * unit_ns)
            if known
            else lower_envelope(x, y)
        )
    intercepts, slopes = np.array(lines).T
    # lines blended with linear weights are lines of blended coefficients
    rates = mean_ns + np.interp(elapsed, centres, slopes)
    mapped = np.interp(elapsed, centres, intercepts) + rates * (elapsed + quantum / 2)
    return host_time_ns[0] + np.rint(mapped).astype(np.int64), list(mean_ns + slopes)
