"""A constant error of the wrench after zeroing."""

from collections.abc import Sequence

import numpy as np

from estimator.effects.effect import HARDLY_INEXACT, Effect, Readings, Values
from estimator.effects.shared.axes import WRENCH_CHANNELS, Frame, in_tissue_axes
from estimator.effects.shared.instants import ORDER
from estimator.effects.shared.sensor_steps import SensorStep, linear_wrench
from estimator.effects.shared.zero_errors import zero_error
from estimator.experiment import Experiment


class ForceBias(Effect):
    """Reported wrench = true wrench + b in every row; b is constant in the axes of the sensor or of the tissue.

    A sensor's own offset turns with it; what the software adds after it has turned the wrench does not. The offset of
    one axis alone is a form of its own: five amplitudes that are not needed would count against it.

    Parameters
    ----------
    frame : in which it is constant
    channel : the only axis that has one; by default all have
    """

    label = "force_bias"
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    measured_by = "read the sensor with the empty gripper before and after"
    words = "The force sensor reads a constant amount too much, because its zero is off."
    inexactness = HARDLY_INEXACT

    def __init__(self, frame: Frame, channel: str = "") -> None:
        self.form = f"{frame}_frame_{channel}" if channel else f"{frame}_frame"
        self._channels = [WRENCH_CHANNELS.index(channel)] if channel else list(range(6))
        self.amplitudes = tuple(zero_error("bias", WRENCH_CHANNELS[n]) for n in self._channels)
        self._turns = frame == "sensor"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add the bias."""
        bias = np.zeros(6)
        bias[self._channels] = [values[amplitude.name] for amplitude in self.amplitudes]
        if self._turns:
            bias = in_tissue_axes(readings.rotation, bias)
        return readings.with_wrench(readings.wrench + bias)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the bias."""
        bias = np.zeros(6)
        bias[self._channels] = [values[amplitude.name] for amplitude in self.amplitudes]
        return (linear_wrench("sensor" if self._turns else "tissue", offset=bias),)


class ForceBiasInOne(ForceBias):
    """The sensor was zeroed before each experiment, and before one of them wrongly."""

    constants = (ORDER,)

    def __init__(self) -> None:
        super().__init__("sensor")
        self.form = "in_one_experiment"

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return every experiment."""
        return [{ORDER.name: float(each.experiment.order)} for each in baseline]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of experiments."""
        return len(experiments)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add the bias to that experiment."""
        return (
            super().readings(readings, values)
            if readings.experiment.order == round(values["order"])
            else readings
        )

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the bias in that experiment, nothing in others."""
        return super().sensor_steps(experiment, values) if experiment.order == round(values["order"]) else ()
