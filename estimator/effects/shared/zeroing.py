"""What is hidden by the zero that was taken at rest.

The zero is the tissue's wrench at the stated rest pose, not that of the first row: the noise of the reported pose
would enter it, and with it the difference between a vanishing effect and none.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from estimator.effects.effect import Readings

ZeroAxes = Literal["gripper", "tissue"]


def with_wrench_zeroed(readings: Readings, axes: ZeroAxes = "gripper") -> Readings:
    """Subtract the wrench at rest, of which nothing is left then.

    A sensor is zeroed on its own axes: when the gripper turns the zero turns along. A zero taken off after the
    readings were turned into the tissue frame does not.
    """
    zero = readings.rest_wrench
    if axes == "gripper":
        since = readings.rotation
        if readings.experiment.first_row == "under_load":
            since = since * since[0].inv()
        zero = np.hstack([since.apply(part) for part in zero.reshape(2, 3)])
    return replace(readings, wrench=readings.wrench - zero, rest_wrench=np.zeros(6))


def with_fiducials_zeroed(readings: Readings) -> Readings:
    """Return the fiducials' motion since rest, from the stated rest positions."""
    motion = readings.fiducials - readings.rest_fiducials
    return readings.with_fiducials(readings.experiment.fiducials_rest + motion)
