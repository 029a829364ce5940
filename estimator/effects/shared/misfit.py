"""What the baseline leaves of the measurements: a search among places or instants begins where it is largest."""

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Readings
from estimator.effects.shared.axes import in_gripper_axes

FloatArray = NDArray[np.float64]


def fiducial_misfit(readings: Readings) -> FloatArray:
    """Return measured less predicted (n, m, 3), m, zero where nothing was measured."""
    return np.nan_to_num(readings.experiment.fiducials - readings.fiducials, nan=0.0)


def wrench_misfit(readings: Readings) -> FloatArray:
    """Return measured less predicted (n, 6) in the sensor's axes, in units of the noise, zero where not measured."""
    noise = readings.experiment.sensor.wrench_std
    misfit = np.nan_to_num(readings.experiment.wrench - readings.wrench, nan=0.0)
    return in_gripper_axes(readings.rotation, misfit) / noise


def measured_or_predicted(readings: Readings) -> FloatArray:
    """Return the measured wrench (n, 6), N and N·m, with the predicted one where it was not measured."""
    measured = readings.experiment.wrench
    return np.where(np.isfinite(measured), measured, readings.wrench)
