"""What instruments add to the truth: white noise, or noise with a structure, and the rounding of the files."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.scenes.scene import Readings
from estimator.experiment import SensorNoise

FloatArray = NDArray[np.float64]

NoiseKind = Literal["standard", "correlated", "quantised", "outliers"]
NOISE_KINDS: tuple[NoiseKind, ...] = get_args(NoiseKind)

_CORRELATION = 0.5
_OUTLIER_SHARE = 0.004
_OUTLIER_SIZE = 6.0
# Steps of a coarse converter, in standard deviations.
_COUNT = 1.25


@dataclass(frozen=True, slots=True)
class Noisy:
    """Readings as the file has them: position (n, 3), wrench (n, 6), beads (n, m, 3)."""

    position: FloatArray
    wrench: FloatArray
    beads: FloatArray


def with_noise(
    readings: Readings, sensor: SensorNoise, kind: NoiseKind, random: np.random.Generator
) -> Noisy:
    """Add noise of the sensor's standard deviations, and round as the dev cases are rounded."""
    position = readings.rows.position + sensor.position_std * random.standard_normal(
        readings.rows.position.shape
    )
    stds = np.repeat([sensor.force_std, sensor.torque_std], 3)
    wrench = readings.wrench + stds * _unit_noise(readings.wrench.shape, kind, random)
    if kind == "quantised":
        wrench = np.round(wrench / (_COUNT * stds)) * (_COUNT * stds)
    flat = readings.beads.reshape(len(position), -1)
    beads = flat + sensor.fiducial_std * _unit_noise(flat.shape, kind, random)
    if kind == "outliers":
        wild = random.random(flat.shape) < _OUTLIER_SHARE
        beads = beads + wild * sensor.fiducial_std * _OUTLIER_SIZE * random.choice([-1.0, 1.0], flat.shape)
    rounded = np.hstack([np.round(wrench[:, :3], 5), np.round(wrench[:, 3:], 7)])
    return Noisy(np.round(position, 7), rounded, np.round(beads, 7).reshape(readings.beads.shape))


def correlation_of(kind: NoiseKind) -> float:
    """Return the correlation of a row's noise with that of the row before."""
    return _CORRELATION if kind == "correlated" else 0.0


def _unit_noise(shape: tuple[int, ...], kind: NoiseKind, random: np.random.Generator) -> FloatArray:
    white, correlation = random.standard_normal(shape), correlation_of(kind)
    noise = white.copy()
    for row in range(1, len(white)):
        noise[row] = correlation * noise[row - 1] + np.sqrt(1 - correlation**2) * white[row]
    return noise
