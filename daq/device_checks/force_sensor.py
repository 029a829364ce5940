"""Is a force sensor fit for a session? Its rate, its range at rest, its noise."""

import math
from typing import Any

import numpy as np

from daq.device_checks.report import Check
from daq.device_checks.streams import collected, counting_rate_hz, identity_check, losses_check, rate_check
from daq.rig import Rig
from robot_drivers.protocols import FloatArray, ForceSensor
from robot_drivers.specification import ForceSensorSpecification

_NOISE_ALLOWANCE = 8.0
"""Times the noise of one count on every gage; the sensor's maker takes 80 counts for the most."""
_TELLING_SAMPLES = 20
"""More samples than these are never all alike in a sensor that works."""
_LARGEST_REST_SHARE = 0.5
"""Of the rated range that a sensor at rest may already need: for its offset and the weight of the tool."""
_AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_UNITS = ("N", "N", "N", "N·m", "N·m", "N·m")


def check_force_sensor(sensor: ForceSensor, rig: Rig, seconds: float) -> list[Check]:
    """Check a connected force sensor, and look for so many seconds at what it reads."""
    specification = rig.force_sensor_specification()
    sensor.start()
    blocks = collected(sensor.read, seconds)
    statistics = sensor.statistics()
    sensor.stop()
    if not blocks:
        return [Check("rate", False, f"no sample came in {seconds:g} s; check that the sensor streams")]
    wrench = np.concatenate([block.wrench for block in blocks])
    usable = np.concatenate([block.usable for block in blocks])
    details = sensor.identity.details
    return [
        identity_check(sensor.identity),
        rate_check(counting_rate_hz(blocks), specification.rate_hz),
        losses_check(statistics),
        Check("units", True, details.get("units") or details.get("counts per N and N·m", "N, N·m")),
        _usable_check(usable),
        _range_check(wrench, specification),
        _noise_check(wrench, specification),
    ]


def _usable_check(usable: np.ndarray[Any, Any]) -> Check:
    share = 100.0 * float(np.mean(~usable))
    return Check(
        "saturation", share == 0.0, f"{share:.3g} % of the samples not usable (status word, gages, range)"
    )


def _range_check(wrench: FloatArray, sensor: ForceSensorSpecification) -> Check:
    """Judge the mean: what is used of the range at rest is not there for the measurement."""
    mean = wrench.mean(axis=0)
    if sensor.rated_wrench is None:
        told = " ".join(f"{value:.3g}" for value in mean)
        return Check("range", True, f"mean {told} N, N·m, of a range that the driver does not say")
    rated = np.array(sensor.rated_wrench)
    shares = np.abs(mean) / rated
    axis = int(shares.argmax())
    told = f"{_AXES[axis]} at {100 * shares[axis]:.0f} % of its ±{rated[axis]:g} {_UNITS[axis]}"
    if shares[axis] > _LARGEST_REST_SHARE:
        told += f", at most {100 * _LARGEST_REST_SHARE:.0f} % is for rest: relieve the sensor, or bias it"
    return Check("range", bool(shares[axis] <= _LARGEST_REST_SHARE), told)


def _noise_check(wrench: FloatArray, sensor: ForceSensorSpecification) -> Check:
    """Judge the scatter about a straight line against the sensor's, where it is known, and against none at all."""
    n = len(wrench)
    ramp = np.stack([np.ones(n), np.linspace(-1.0, 1.0, n)], axis=1)
    residuals = wrench - ramp @ np.linalg.lstsq(ramp, wrench, rcond=None)[0]
    noise = residuals.std(axis=0, ddof=min(2, n - 1))
    step = np.array(sensor.resolution or np.zeros(6))
    told = "std " + " ".join(f"{value:.2g}" for value in noise) + " N, N·m"
    if n > _TELLING_SAMPLES and not noise.any() and not step.any():
        return Check("noise", False, f"{told}: no channel moves by a count; the sensor repeats one sample")
    if sensor.noise_std is None:
        return Check("noise", True, f"{told}, of a sensor whose noise the driver does not say")
    expected = np.hypot(sensor.noise_std, step / math.sqrt(12.0))
    axis = int((noise / expected).argmax())
    limit = _NOISE_ALLOWANCE * expected[axis]
    if noise[axis] > limit:
        told += f"; {_AXES[axis]} at most {limit:.2g} expected: does something move, or a cable pick up?"
    return Check("noise", bool(noise[axis] <= limit), told)
