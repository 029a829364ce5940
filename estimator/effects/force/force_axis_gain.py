"""One axis of the force sensor reads too much or too little."""

from collections.abc import Sequence

import numpy as np

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.axes import (
    WRENCH_CHANNELS,
    Frame,
    changed_in,
    in_gripper_axes,
    in_tissue_axes,
)
from estimator.effects.shared.largest_load import LARGEST_LOAD, largest_loads
from estimator.effects.shared.of_each_experiment import ReadingsOfEachExperiment
from estimator.effects.shared.sensor_steps import SensorStep, linear_wrench, power_of_load
from estimator.experiment import Experiment


def _gain(name: str) -> Amplitude:
    return Amplitude(name, "1", scale=0.08, smallest=0.01, lower=-1.0)


class ForceAxisGain(Effect):
    """Reported component = (1 + gain) times the true one, for one axis of the sensor, which turns with the gripper.

    A gain that all axes have in common is no effect: it is Young's modulus.
    """

    label = "force_axis_gain"
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    measured_by = "hang a known weight on the gripper along each axis"
    words = "One axis of the force sensor reads too much or too little in proportion to its load."
    inexactness = HARDLY_INEXACT
    amplitudes: tuple[Amplitude, ...] = (_gain("gain"),)

    def __init__(self, channel: str) -> None:
        self.form = channel
        self._unit = np.diag(np.eye(6)[WRENCH_CHANNELS.index(channel)])

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the component."""
        gain = values["gain"] * self._unit
        return readings.with_wrench(changed_in("sensor", readings.rotation, readings.wrench, gain))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the gain."""
        return (linear_wrench("sensor", np.eye(6) + values["gain"] * self._unit),)


class ForceGains(ForceAxisGain):
    """Every axis has a gain of its own, of the sensor or of what software makes of it in the tissue's axes.

    Parameters
    ----------
    frame : of whose axes the gains are
    """

    amplitudes = tuple(_gain(f"gain_{channel}") for channel in WRENCH_CHANNELS)
    elaborates = "fx"

    def __init__(self, frame: Frame) -> None:
        self.form = f"all_axes_{frame}_frame"
        self._frame: Frame = frame

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the components."""
        gains = np.diag([values[amplitude.name] for amplitude in self.amplitudes])
        return readings.with_wrench(changed_in(self._frame, readings.rotation, readings.wrench, gains))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the gains."""
        gains = np.diag([1.0 + values[amplitude.name] for amplitude in self.amplitudes])
        return (linear_wrench(self._frame, gains),)


class ForceBentGain(ForceAxisGain):
    """The gain of one axis bends with the load, alike in both directions: w' = w + b (w/L)² w.

    A bridge that stiffens or yields, or that was loaded beyond its range. L is the largest load that is predicted on
    that axis, so that b is the gain's error there; it is a constant of the search and is told with the result.
    """

    elaborates = "fx"
    amplitudes = (_gain("bend"),)
    constants = (Constant("channel", "1", (), 0.0, 5.0, fixed=True), LARGEST_LOAD)

    def __init__(self) -> None:
        self.form = "bent"

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return every axis that is loaded, with its largest load."""
        loads = largest_loads(baseline)
        return [{"channel": float(n), LARGEST_LOAD.name: loads[n]} for n in range(6) if loads[n]]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of axes."""
        return len(WRENCH_CHANNELS)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the component by what its load makes of the gain."""
        channel = round(values["channel"])
        load = in_gripper_axes(readings.rotation, readings.wrench)[:, channel]
        change = np.zeros_like(readings.wrench)
        change[:, channel] = values["bend"] * (load / values[LARGEST_LOAD.name]) ** 2 * load
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, change))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the cubic term."""
        channel = round(values["channel"])
        return (power_of_load(channel, channel, 3, values["bend"] / values[LARGEST_LOAD.name] ** 2),)


class ForceAxisGainOfEach(ReadingsOfEachExperiment, ForceAxisGain):
    """The gain goes with the temperature of the day."""
