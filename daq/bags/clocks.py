"""When the messages of a stream were taken: by their own stamps, mapped to the recorder's clock, or of receipt.

``header.stamp`` is of the clock of the computer or device that made the message, log time of the recorder's. Stamps of
the recorder's own clock are used as they are; those of another are mapped to it by the lower envelope, as the clock of
a device is in a session (:mod:`daq.timing.event_times`). Nothing is written back: both stamps stay beside the time.
"""

from dataclasses import dataclass

import numpy as np

from daq.bags.series import NO_STAMP, Series
from daq.timing.event_times import estimate_event_times
from robot_drivers.protocols import IntArray

# Messages of the same computer come after their stamp, within the exposure of a camera and a queue or two; its clock
# does not go away from itself.
_EARLIEST_NS, _LATEST_NS, _DRIFT_NS = -1_000_000, 100_000_000, 5_000_000


@dataclass(frozen=True, slots=True, eq=False)
class StreamTimes:
    """Times (n,) of the messages on the recorder's clock, ns, and how they were found."""

    time_ns: IntArray
    how: str


def stream_times(series: Series) -> StreamTimes:
    """Return when the messages of a stream were taken."""
    log, header = series.log_time_ns, series.header_time_ns
    missing = int(np.sum(header == NO_STAMP))
    if missing:
        of = (
            f"{missing} of {series.rows} messages have no header.stamp"
            if missing < series.rows
            else "no header.stamp"
        )
        return StreamTimes(log, f"log time ({of})")
    if np.array_equal(log, header):
        return StreamTimes(header, "header.stamp, which is the log time")
    if series.rows < 2:
        return StreamTimes(log, "log time")
    # the stamps count the messages: one that leaps ahead of all of them was set
    mapped = estimate_event_times(header, log, unit_ns=1.0, counter=np.arange(series.rows))
    shift = mapped.time_ns - header
    delay = log - header
    told = (
        f"received {np.median(delay) / 1e6:.3f} ms after it in the median, "
        f"{delay.min() / 1e6:.3f} to {delay.max() / 1e6:.3f} ms"
    )
    own = shift.min() >= _EARLIEST_NS and shift.max() <= _LATEST_NS and np.ptp(shift) <= _DRIFT_NS
    if own and not mapped.resets:
        return StreamTimes(header, f"header.stamp as it is ({told})")
    begun = f", begun anew {mapped.resets} times" if mapped.resets else ""
    return StreamTimes(
        mapped.time_ns,
        f"header.stamp mapped to the recorder's clock ({told}; wanders by {mapped.wander_ppm:.0f} ppm{begun})",
    )
