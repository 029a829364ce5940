"""Two fiducials are exchanged from some instant on."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.instants import (
    ORDER,
    SHARE_OF_TIME,
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
        return (
            {
                "kind": "beads_exchanged",
                "beads": [bead(values, "first"), bead(values, "second")],
                "share": values["exchanged"],
                "seconds": seconds_of(experiment, self._exchanged(experiment, values)),
            },
        )

    def _exchanged(self, experiment: Experiment, values: Values) -> BoolArray:
        return after(experiment, values)


class FiducialMislabelWithin(FiducialMislabel):
    """Only in the experiment in which it begins: the next starts with the beads named anew."""

    form = "within_an_experiment"

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the pair and the instant whose exchange takes most off the misfit of one experiment."""
        gains = [sums_to_the_end(_gain(each)) for each in baseline]
        best = int(np.argmax([gain.max() for gain in gains]))
        row, first, second = _largest(gains[best])
        return [{"first": first, "second": second, **start_of_row([baseline[best]], row)}]

    def _exchanged(self, experiment: Experiment, values: Values) -> BoolArray:
        return after(experiment, values) & (experiment.order == round(values["order"]))


class FiducialMislabelInEach(FiducialMislabel):
    """In every experiment from the same time on."""

    form = "in_each_experiment"
    constants = (bead_constant("first"), bead_constant("second"), TIME)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the pair and the instant whose exchange takes most off the misfit."""
        courses = [self._course(each.experiment) for each in baseline]
        instants = np.unique(np.concatenate(courses))
        gain = np.zeros((len(instants), *_gain(baseline[0]).shape[1:]))
        for course, each in zip(courses, baseline, strict=True):
            np.add.at(gain, np.searchsorted(instants, course), _gain(each))
        row, first, second = _largest(sums_to_the_end(gain))
        start = 0.5 * (instants[row] + instants[row - 1]) if row else instants[0]
        return [{"first": first, "second": second, self._instant: float(start)}]

    def _exchanged(self, experiment: Experiment, values: Values) -> BoolArray:
        return self._course(experiment) >= values[self._instant]

    @property
    def _instant(self) -> str:
        return self.constants[-1].name

    def _course(self, experiment: Experiment) -> FloatArray:
        """Return (n,) in what the instant is counted."""
        return experiment.time


class FiducialMislabelFromShare(FiducialMislabelInEach):
    """In every experiment from the same share of its duration on: slow ones and quick ones are gone through alike."""

    form = "from_a_share_of_each_experiment"
    constants = (bead_constant("first"), bead_constant("second"), SHARE_OF_TIME)

    def _course(self, experiment: Experiment) -> FloatArray:
        begin, end = experiment.time[[0, -1]]
        return (experiment.time - begin) / (end - begin)


def _gain(readings: Readings) -> FloatArray:
    """Return by how much exchanging beads a and b lowers the sum of squares of a row, (n, m, m), m²."""
    apart = readings.experiment.fiducials[:, :, None] - readings.fiducials[:, None]
    squares = np.nan_to_num(apart**2, nan=0.0).sum(axis=-1)
    own = np.einsum("naa->na", squares)
    return own[:, :, None] + own[:, None] - squares - squares.transpose(0, 2, 1)


def _largest(gain: FloatArray) -> tuple[int, float, float]:
    """Return row and pair (a < b) of the largest gain, of (n, m, m)."""
    first, second = np.triu_indices(gain.shape[1], k=1)
    row, pair = np.unravel_index(np.argmax(gain[:, first, second]), (len(gain), len(first)))
    return int(row), float(first[pair]), float(second[pair])
