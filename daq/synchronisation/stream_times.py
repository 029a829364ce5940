"""When the samples of each stream of a recording were taken: which of a device's clocks is asked, and its latency.

A force sensor's counter is its best clock; robot and cameras have a clock in seconds beside it. What is known to delay
the stamps of a stream against those of the robot is taken off.
"""

from dataclasses import replace

import numpy as np

from daq.recording.stored_streams import Images
from daq.rig import Rig
from daq.timing.event_times import EventTimes, estimate_event_times
from robot_drivers.protocols import FloatArray, IntArray, PoseBlock, WrenchBlock

SECOND_NS = 1e9


def force_times(force: WrenchBlock, rig: Rig) -> EventTimes:
    """Return when the force samples were taken; raises SynchronisationError for fewer than two."""
    return _earlier(estimate_event_times(force.counter, force.host_time_ns), rig.latencies.force_s)


def robot_times(robot: PoseBlock) -> EventTimes:
    """Return when the robot's states were measured; raises SynchronisationError for fewer than two."""
    return clock_times(robot.device_time_s, robot.host_time_ns, robot.counter)


def exposure_times(images: Images, rig: Rig) -> EventTimes:
    """Return when the images were exposed; raises SynchronisationError for fewer than two."""
    return _earlier(
        clock_times(images.device_time_s, images.host_time_ns, images.counter), rig.latencies.cameras_s
    )


def clock_times(device_time_s: FloatArray, host_time_ns: IntArray, counter: IntArray) -> EventTimes:
    """Map a clock in seconds (n,) to the host clock; the receive stamps stay where the device has none (NaN).

    The counter (n,) of the same samples tells when the clock leaps.
    """
    if not np.all(np.isfinite(device_time_s)):
        return estimate_event_times(host_time_ns, host_time_ns)
    return estimate_event_times(device_time_s, host_time_ns, unit_ns=SECOND_NS, counter=counter)


def _earlier(stamped: EventTimes, latency_s: float) -> EventTimes:
    return replace(stamped, time_ns=stamped.time_ns - round(latency_s * SECOND_NS))
