"""The force stream lags or leads the pose stream."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import in_gripper_axes, in_tissue_axes
from estimator.effects.shared.instants import at_other_times
from estimator.effects.shared.of_each_experiment import ReadingsOfEachExperiment
from estimator.effects.shared.sensor_steps import SensorStep, delay, filter_of_wrench, slow_clock_of_wrench
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]


class TimeOffset(Effect):
    """The row of time t holds what the sensor felt, in its own axes, at t − lag (or t + lead).

    Between rows the wrench is interpolated; before the first and after the last the gripper stands. Lag and lead are
    two forms because the wrench has a kink wherever the gripper starts or stops: a row there sees the motion before
    it or the one after it.
    """

    label = "time_offset"
    group = "timing"
    stage = "force"
    acts_on = ("readings",)
    measured_by = "tap the gripper and compare the two clocks"
    words = "The force stream is shifted in time against the pose stream."
    inexactness = HARDLY_INEXACT

    def __init__(self, form: Literal["lag", "lead"]) -> None:
        self.form = form
        self.amplitudes = (Amplitude(form, "s", scale=0.3, smallest=0.02, lower=0.0),)
        self._sign = -1.0 if form == "lag" else 1.0

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Shift the wrench in time."""
        time = readings.experiment.time
        wrench = in_gripper_axes(readings.rotation, readings.wrench)
        shifted = at_other_times(time, wrench, self._sign * values[self.form])
        change = in_tissue_axes(readings.rotation, shifted - wrench)
        return readings.with_wrench(readings.wrench + change)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the shift in time."""
        return (delay("wrench", -self._sign * values[self.form]),)


class Filtered(TimeOffset):
    """The force stream is late because a filter of the first order smooths it, in the sensor's own axes.

    y + T dy/dt = w, exactly for a wrench that goes in straight lines between rows. To first order it is a lag of T.
    """

    elaborates = "lag"
    amplitudes = (Amplitude("filter_time", "s", scale=0.3, smallest=0.02, lower=0.0),)

    def __init__(self) -> None:
        self.form = "filtered"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Smooth the wrench."""
        filter_time = values["filter_time"]
        if not filter_time:
            return readings
        wrench = in_gripper_axes(readings.rotation, readings.wrench)
        change = in_tissue_axes(readings.rotation, -_behind(readings.experiment.time, wrench, filter_time))
        return readings.with_wrench(readings.wrench + change)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the filter."""
        return (filter_of_wrench(values["filter_time"]),)


class GrowingOffset(TimeOffset):
    """The force's clock runs slow or fast: the row of time t holds t − r (t − t₁), t₁ being the experiment's first.

    Each experiment begins with clocks that agree. Two forms, as of a constant shift and for its reason.
    """

    def __init__(self, elaborates: Literal["lag", "lead"]) -> None:
        super().__init__(elaborates)
        self.form, self.elaborates = f"growing_{elaborates}", elaborates
        self.amplitudes = (Amplitude("rate", "s/s", scale=0.01, smallest=5e-4, lower=0.0, upper=0.5),)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Shift the wrench in time, each row by its own."""
        time = readings.experiment.time
        wrench = in_gripper_axes(readings.rotation, readings.wrench)
        shifted = at_other_times(time, wrench, self._sign * values["rate"] * (time - time[0]))
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, shifted - wrench))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return how slow the clock is."""
        return (slow_clock_of_wrench(-self._sign * values["rate"]),)


class TimeOffsetOfEach(ReadingsOfEachExperiment, TimeOffset):
    """The clocks were set against each other before each experiment, by another amount."""


def _behind(time: FloatArray, rows: FloatArray, filter_time: float) -> FloatArray:
    """Return by how much (n, k) a filter is behind rows (n, k) of times (n,), s; it has settled at the first."""
    behind = np.zeros_like(rows)
    for n in range(1, len(rows)):
        elapsed = time[n] - time[n - 1]
        steady = filter_time * (rows[n] - rows[n - 1]) / elapsed
        behind[n] = steady + (behind[n - 1] - steady) * np.exp(-elapsed / filter_time)
    return behind
