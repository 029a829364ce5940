"""What is hidden by the zero that was taken at rest.

The zero is the tissue's wrench at the stated rest pose, not that of the first row: the noise of the reported pose
would enter it, and with it the difference between a vanishing effect and none.
"""

from typing import Literal

import numpy as np

from estimator.effects.effect import Readings

ZeroAxes = Literal["gripper", "tissue"]


def with_wrench_zeroed(readings: Readings, axes: ZeroAxes = "gripper") -> Readings:
    """Subtract the wrench at rest.

    A sensor is zeroed on its own axes: when the gripper turns the zero turns along. A zero taken off after the
    readings were turned into the tissue frame does not.
    """
    if axes == "tissue":
        return readings.with_wrench(readings.wrench - readings.rest_wrench)
    zero = np.hstack([readings.rotation.apply(part) for part in readings.rest_wrench.reshape(2, 3)])
    return readings.with_wrench(readings.wrench - zero)


def with_fiducials_zeroed(readings: Readings) -> Readings:
    """Return the fiducials' motion since rest, from the stated rest positions."""
    motion = readings.fiducials - readings.rest_fiducials
    return readings.with_fiducials(readings.experiment.fiducials_rest + motion)
