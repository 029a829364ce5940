"""Two fiducials are exchanged from some instant on."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.instants import (
    ORDER,
    TIME,
    after,
    bead,
    bead_constant,
    in_order,
    number_of_beads,
    number_of_rows,
    seconds_of,
    start_of_row,
    sums_to_the_end,
)
from estimator.effects.shared.sensor_steps import SensorStep
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class FiducialMislabel(Effect):
    """From an instant on, the columns of two beads hold each the other's position, to the last experiment.

    The amplitude is 1 where they are exchanged; between, the positions are mixed in proportion.
    """

    label = "fiducial_mislabel"
    group = "vision"
    stage = "vision"
    acts_on = ("readings",)
    linear = True
    words = "Two fiducials are mistaken for each other from some instant on."
    inexactness = 0.0
    fewest_beads = 2
    of_single_beads = True
    form = "to_the_last_experiment"
    amplitudes = (Amplitude("exchanged", "1", scale=1.0, smallest=0.1, lower=0.0, upper=1.0),)
    constants: tuple[Constant, ...] = (bead_constant("first"), bead_constant("second"), ORDER, TIME)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the pair and the instant whose exchange takes most off the misfit."""
        ordered = in_order(baseline)
        gain = sums_to_the_end(np.concatenate([_gain(each) for each in ordered]))
        row, first, second = _largest(gain)
        return [{"first": first, "second": second, **start_of_row(ordered, row)}]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of pairs and rows."""
        return math.comb(number_of_beads(experiments), 2) * number_of_rows(experiments)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Exchange the two beads."""
        first, second = bead(values, "first"), bead(values, "second")
        rows = self._exchanged(readings.experiment, values)
        fiducials = readings.fiducials.copy()
        shift = values["exchanged"] * (fiducials[rows, second] - fiducials[rows, first])
        fiducials[rows, first] += shift
        fiducials[rows, second] -= shift
        return readings.with_fiducials(fiducials)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the two beads, and the rows in which they are exchanged."""
        return (self._step(values, seconds_of(experiment, self._exchanged(experiment, values))),)

    def _step(self, values: Values, seconds: list[float] | None) -> SensorStep:
        return {
            "kind": "beads_exchanged",
            "beads": [bead(values, "first"), bead(values, "second")],
            "share": values["exchanged"],
            "seconds": seconds,
        }

    def _exchanged(self, experiment: Experiment, values: Values) -> BoolArray:
        return after(experiment, values)


class FiducialMislabelWhereTurned(FiducialMislabel):
    """In every row in which the measured way from one bead to the other is turned round against that at rest.

    No tissue between two beads turns by more than a quarter of a turn in a retraction: such a row shows by itself that
    they are exchanged, in whatever rows that is so, once or now and then.
    """

    form = "wherever_they_are_turned_round"
    words = "Two fiducials are mistaken for each other in some rows."
    constants = (bead_constant("first"), bead_constant("second"))

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the pair whose exchange in such rows takes most off the misfit."""
        gains = [(_turned_round(each.experiment) * _gain(each)).sum(axis=0) for each in baseline]
        _, first, second = _largest(np.sum(gains, axis=0)[None])
        return [{"first": first, "second": second}]

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the two beads once for each run of rows in which they are exchanged."""
        exchanged = self._exchanged(experiment, values)
        runs = np.split(np.arange(len(exchanged)), np.flatnonzero(np.diff(exchanged)) + 1)
        return tuple(
            self._step(values, [float(one) for one in experiment.time[run[[0, -1]]]])
            for run in runs
            if exchanged[run].any()
        )

    def _exchanged(self, experiment: Experiment, values: Values) -> BoolArray:
        return np.asarray(_turned_round(experiment)[:, bead(values, "first"), bead(values, "second")])


def _turned_round(experiment: Experiment) -> BoolArray:
    """Tell of each row and pair of beads whether the way between them is turned round, (n, m, m).

    Then they lie nearer to each other's rest positions; of one that is seen alone the same is asked.
    """
    return _saved(experiment.fiducials, experiment.fiducials_rest[None]) > 0.0


def _gain(readings: Readings) -> FloatArray:
    """Return by how much exchanging beads a and b lowers the sum of squares of a row, (n, m, m), m²."""
    return _saved(readings.experiment.fiducials, readings.fiducials)


def _saved(seen: FloatArray, expected: FloatArray) -> FloatArray:
    """Return the same of beads seen (n, m, 3) where others are expected; one that is not seen counts for nothing."""
    apart = seen[:, :, None] - expected[:, None]
    squares = np.nan_to_num(apart**2, nan=0.0).sum(axis=-1)
    own = np.einsum("naa->na", squares)
    return np.asarray(own[:, :, None] + own[:, None] - squares - squares.transpose(0, 2, 1))


def _largest(gain: FloatArray) -> tuple[int, float, float]:
    """Return row and pair (a < b) of the largest gain, of (n, m, m)."""
    first, second = np.triu_indices(gain.shape[1], k=1)
    row, pair = np.unravel_index(np.argmax(gain[:, first, second]), (len(gain), len(first)))
    return int(row), float(first[pair]), float(second[pair])
