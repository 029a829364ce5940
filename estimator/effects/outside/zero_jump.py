"""The force sensor's zero jumps while an experiment runs: no label of the catalogue."""

from collections.abc import Sequence

import numpy as np

from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import WRENCH_CHANNELS, in_tissue_axes
from estimator.effects.shared.instants import ORDER, TIME, number_of_rows, start_of_row, sums_to_the_end
from estimator.effects.shared.misfit import wrench_misfit
from estimator.experiment import Experiment

_UNITS = 3 * ["N"] + 3 * ["N·m"]
_SCALES = 3 * [0.1] + 3 * [0.004]
_SMALLEST = 3 * [0.01] + 3 * [0.0005]


class ZeroJump(Effect):
    """From an instant of one experiment to its end the wrench is off by a constant in the sensor's axes.

    Somebody zeroed the sensor again under way, or it was knocked. The next experiment begins with a zero of its own.
    """

    label = OUTSIDE
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    words = "The force sensor's zero jumps in the middle of an experiment."
    form = "zero_jump"
    amplitudes = tuple(
        Amplitude(f"jump_{channel}", unit, scale, smallest)
        for channel, unit, scale, smallest in zip(WRENCH_CHANNELS, _UNITS, _SCALES, _SMALLEST, strict=True)
    )
    constants = (ORDER, TIME)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return for each experiment the instant from which a constant lowers its misfit most."""
        return [start_of_row([each], _likeliest_row(each)) for each in baseline]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of rows."""
        return number_of_rows(experiments)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add the jump."""
        if readings.experiment.order != round(values["order"]):
            return readings
        late = readings.experiment.time >= values["time"]
        jump = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        change = in_tissue_axes(readings.rotation, np.outer(late, jump))
        return readings.with_wrench(readings.wrench + change)


def _likeliest_row(readings: Readings) -> int:
    """Return the row from which a constant on every axis explains most."""
    misfit = wrench_misfit(readings)
    rows_left = np.arange(len(misfit), 0, -1)
    return int(np.argmax((sums_to_the_end(misfit) ** 2).sum(axis=1) / rows_left))
