"""The largest load on an axis of the sensor, at which the size of an error is stated that is no line of the load."""

from collections.abc import Sequence

import numpy as np

from estimator.effects.effect import Constant, Readings
from estimator.effects.shared.axes import in_gripper_axes

# In N or N·m, as the axis; the grid is only where nothing is known of the loads.
LARGEST_LOAD = Constant("largest_load", "N or N·m", (2.0,), 1e-6, np.inf, fixed=True)


def largest_loads(baseline: Sequence[Readings]) -> list[float]:
    """Return the largest load on each axis of the sensor (6) that is predicted in any experiment, N and N·m."""
    loads = [np.abs(in_gripper_axes(each.rotation, each.wrench)).max(axis=0) for each in baseline]
    return [float(load) for load in np.max(loads, axis=0)]
