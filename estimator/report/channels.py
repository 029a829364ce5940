"""Residuals by channel: how large they are, and whether the sensors' noise explains them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fit.result import ExperimentFit

FloatArray = NDArray[np.float64]

WRENCH_CHANNELS = ("fx", "fy", "fz", "tx", "ty", "tz")
CHANNELS = (*WRENCH_CHANNELS, "fiducials x", "fiducials y", "fiducials z")


@dataclass(frozen=True, slots=True)
class ChannelResidual:
    """Measured minus predicted of one channel in one experiment.

    Attributes
    ----------
    name : a component of the wrench, or a coordinate of all fiducials
    unit : of ``rms``
    count : values that were measured
    rms : root mean square; NaN where nothing was measured
    rms_sigma : the same in units of what noise gives it: the sensor's, and that of the gripper's reported position
    scatter_sigma : without the mean of each signal, which the fit takes as a tare or as a wrong rest position
    """

    name: str
    unit: str
    count: int
    rms: float
    rms_sigma: float
    scatter_sigma: float


def wrench_residual(fit: ExperimentFit) -> FloatArray:
    """Return the residual wrench (n, 6) in units of what noise gives it."""
    return (fit.experiment.wrench - fit.wrench) / fit.wrench_std


def fiducial_residual(fit: ExperimentFit) -> FloatArray:
    """Return the residual fiducial positions (n, m, 3) in units of what noise gives them."""
    return (fit.experiment.fiducials - fit.fiducials) / fit.fiducials_std


def channel_residuals(fit: ExperimentFit) -> list[ChannelResidual]:
    """Return the residuals of an experiment in the order of ``CHANNELS``."""
    stds = [*(fit.wrench_std[:, [i]] for i in range(6)), *(fit.fiducials_std[:, :, i] for i in range(3))]
    wrench, fiducials = wrench_residual(fit), fiducial_residual(fit)
    signals = [*(wrench[:, [i]] for i in range(6)), *(fiducials[:, :, i] for i in range(3))]
    units = ["N"] * 3 + ["N·m"] * 3 + ["m"] * 3
    return [
        _summary(name, unit, std, signal)
        for name, unit, std, signal in zip(CHANNELS, units, stds, signals, strict=True)
    ]


def worst_fiducial(fit: ExperimentFit) -> tuple[int, float] | None:
    """Return the fiducial that the prediction misses most, and its root mean square residual in units of the noise.

    None where no fiducial was measured.
    """
    residual = fiducial_residual(fit)
    by_fiducial = np.array([root_mean_square(residual[:, i]) for i in range(residual.shape[1])])
    if not np.isfinite(by_fiducial).any():
        return None
    worst = int(np.nanargmax(by_fiducial))
    return worst, float(by_fiducial[worst])


def root_mean_square(values: FloatArray) -> float:
    """Return the root mean square of what was measured; NaN where nothing was."""
    measured = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(measured**2))) if len(measured) else float("nan")


def _summary(name: str, unit: str, std: FloatArray, residual: FloatArray) -> ChannelResidual:
    """Summarise signals (n, s) that are given in units of ``std``, (n, s)."""
    measured = np.isfinite(residual)
    count = measured.sum(axis=0)
    mean = np.nansum(residual, axis=0) / np.maximum(count, 1)
    freedoms = int(np.maximum(count - 1, 0).sum())
    squares = float(np.nansum((residual - mean) ** 2))
    scatter = float(np.sqrt(squares / freedoms)) if freedoms else float("nan")
    rms, rms_sigma = root_mean_square(residual * std), root_mean_square(residual)
    return ChannelResidual(name, unit, int(count.sum()), rms, rms_sigma, scatter)
