"""A wrench error that grows with time."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.axes import WRENCH_CHANNELS, Frame, in_tissue_axes
from estimator.effects.shared.sensor_steps import SensorStep, wave_of_wrench
from estimator.effects.shared.zero_errors import zero_error
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]
Course = Literal["linear", "saturating", "running_on", "zeroed_once", "power"]

_UNITS = 3 * ["N/s"] + 3 * ["N·m/s"]
_SCALES = 3 * [3e-3] + 3 * [8e-5]
_SMALLEST = 3 * [2e-4] + 3 * [8e-6]
# What settles within less than this is an offset of the zero.
_TIME_CONSTANT = Constant("time_constant", "s", (20.0, 60.0, 180.0), 10.0, 3600.0)
# Of time: a half where heat soaks into the sensor, above one where it is only beginning to warm.
_POWER = Constant("power", "1", (0.5,), lower=0.2, upper=3.0)
# At which drift by any power of time has reached what it would with its rate at first.
_MINUTE_S = 60.0
_INTERVAL = Constant("interval", "s", (100.0, 300.0), 10.0, 1e5)
_CONSTANTS: dict[Course, tuple[Constant, ...]] = {
    "linear": (),
    "saturating": (_TIME_CONSTANT,),
    "running_on": (_TIME_CONSTANT, _INTERVAL),
    "zeroed_once": (_INTERVAL,),
    "power": (_POWER,),
}
_PERIOD = Constant("period", "s", (40.0, 80.0, 160.0), 15.0, 1200.0)
# Whole periods between two experiments do not show.
_TURNS = Constant("turns_between", "1", (0.0, 0.25, 0.5, 0.75), -0.5, 1.5)
_FINER: frozenset[Course] = frozenset(("zeroed_once", "power"))


class ForceDrift(Effect):
    """Reported wrench = true wrench + r g(t); r is the rate at first, constant in the sensor's or the tissue's axes.

    The sensor is zeroed at the first row of every experiment, so that g = t for steady drift and
    g = τ (1 − exp(−t/τ)) where the sensor warms towards a steady state of its own (Newton's law of cooling). Where
    warming runs on from experiment to experiment, each an ``interval`` after the one before, what is left of it has
    become smaller: g = exp(−(order − 1) interval/τ) τ (1 − exp(−t/τ)). A sensor that is zeroed before the first
    experiment alone has drifted all the time: g = t + (order − 1) interval. Drift by a power of time has
    g = T (t/T)^p, with T a minute and r its mean rate over that.
    """

    label = "force_drift"
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    measured_by = "read the sensor with the empty gripper before and after"
    words = "The force sensor's reading drifts with time."

    def __init__(self, course: Course, frame: Frame) -> None:
        self.form = f"{course}_{frame}_frame"
        self.amplitudes = tuple(
            Amplitude(f"drift_{channel}", unit, scale, smallest)
            for channel, unit, scale, smallest in zip(
                WRENCH_CHANNELS, _UNITS, _SCALES, _SMALLEST, strict=True
            )
        )
        self.constants = _CONSTANTS[course]
        self._zeroed_once = course == "zeroed_once"
        self.elaborates = f"linear_{frame}_frame" if course in _FINER else ""
        self._turns = frame == "sensor"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add the drift."""
        rate = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        grown = _grown(readings.experiment, values)
        if self._zeroed_once:
            grown = grown + (readings.experiment.order - 1) * values[_INTERVAL.name]
        drift = np.outer(grown, rate)
        if self._turns:
            drift = in_tissue_axes(readings.rotation, drift)
        return readings.with_wrench(readings.wrench + drift)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the drift of this experiment as its course through time."""
        before = (experiment.order - 1) * values[_INTERVAL.name] if _INTERVAL.name in values else 0.0
        constant = values.get(_TIME_CONSTANT.name)
        rate = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        return (
            {
                "kind": "drift_of_wrench",
                "axes": "gripper" if self._turns else "tissue",
                "power": values.get(_POWER.name),
                "rate": (rate if constant is None else rate * np.exp(-before / constant)).tolist(),
                "time_constant": constant,
                "seconds_before": before if self._zeroed_once else 0.0,
            },
        )


class PeriodicDrift(ForceDrift):
    """The zero comes and goes with the air of the room: r' = r + s (sin φ − sin φ₁) + c (cos φ − cos φ₁).

    φ = 2π (t − t₁)/P + 2π n (order − 1): in each experiment the room is further in its course by n periods. s and
    c are constant in the axes of the sensor, which was zeroed at the first row, of time t₁ and phase φ₁.
    """

    elaborates = "linear_sensor_frame"
    amplitudes = tuple(
        zero_error(part, channel) for part in ("sine", "cosine") for channel in WRENCH_CHANNELS
    )
    constants = (_PERIOD, _TURNS)

    def __init__(self) -> None:
        self.form = "periodic_sensor_frame"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add the drift."""
        experiment, (sine, cosine) = readings.experiment, self._parts(values)
        phase = _phase(experiment, values)
        drift = np.outer(np.sin(phase) - np.sin(phase[0]), sine) + np.outer(
            np.cos(phase) - np.cos(phase[0]), cosine
        )
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, drift))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the drift of this experiment."""
        sine, cosine = self._parts(values)
        begun = _phase(experiment, values)[0]
        return (wave_of_wrench(sine, cosine, values[_PERIOD.name], begun),)

    def _parts(self, values: Values) -> FloatArray:
        """Return the amplitudes of sine and cosine (2, 6)."""
        return np.array([values[amplitude.name] for amplitude in self.amplitudes]).reshape(2, 6)


def _grown(experiment: Experiment, values: Values) -> FloatArray:
    """Return g (n,), s: the drift since the zeroing for a unit rate at first."""
    if _POWER.name in values:
        return np.asarray(_MINUTE_S * (experiment.time / _MINUTE_S) ** values[_POWER.name])
    if "time_constant" not in values:
        return experiment.time
    constant = values["time_constant"]
    past = (experiment.order - 1) * values.get("interval", 0.0)
    return -constant * np.exp(-past / constant) * np.expm1(-experiment.time / constant)


def _phase(experiment: Experiment, values: Values) -> FloatArray:
    """Return φ (n,), rad."""
    elapsed = experiment.time - experiment.time[0]
    return np.asarray(
        2 * np.pi * (elapsed / values[_PERIOD.name] + (experiment.order - 1) * values[_TURNS.name])
    )
