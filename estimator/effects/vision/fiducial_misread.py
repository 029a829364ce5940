"""One fiducial is read at a false place."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.axes import AXES
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
from estimator.effects.shared.misfit import fiducial_misfit
from estimator.effects.shared.sensor_steps import SensorStep
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_TRIED_BEADS = 3


class FiducialMisread(Effect):
    """The position read for one bead is the true one plus a constant offset, in every row."""

    label = "fiducial_misread"
    group = "vision"
    stage = "vision"
    of_single_beads = True
    acts_on = ("readings",)
    linear = True
    words = "One fiducial is read at a false place."
    form = "always"
    amplitudes = tuple(Amplitude(f"offset_{axis}", "m", scale=1.5e-3, smallest=1e-4) for axis in AXES)
    constants: tuple[Constant, ...] = (bead_constant("bead"),)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the beads whose mean misfit is largest."""
        mean = np.concatenate([fiducial_misfit(each) for each in baseline]).mean(axis=0)
        worst = np.argsort(-np.linalg.norm(mean, axis=1))
        return [{"bead": float(number)} for number in worst[:_TRIED_BEADS]]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of beads."""
        return number_of_beads(experiments)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Move the bead."""
        offset = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        fiducials = readings.fiducials.copy()
        fiducials[self._misread(readings.experiment, values), bead(values, "bead")] += offset
        return readings.with_fiducials(fiducials)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the offset, and the rows that it touches."""
        return (
            {
                "kind": "bead_aside",
                "bead": bead(values, "bead"),
                "offset": [values[amplitude.name] for amplitude in self.amplitudes],
                "seconds": seconds_of(experiment, self._misread(experiment, values)),
            },
        )

    def _misread(self, experiment: Experiment, values: Values) -> BoolArray:
        return np.ones(len(experiment.time), dtype=bool)


class FiducialMisreadWithin(FiducialMisread):
    """In one experiment alone: the tracker took a reflection for the bead, and was told better before the next."""

    form = "one_experiment"
    constants = (bead_constant("bead"), ORDER)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the beads and experiments whose misfit an offset lowers most."""
        misfits = [fiducial_misfit(each) for each in baseline]
        gain = np.stack([(misfit.sum(axis=0) ** 2).sum(axis=-1) / len(misfit) for misfit in misfits])
        worst = np.argsort(-gain, axis=None)[:_TRIED_BEADS]
        return [
            {"bead": float(number), "order": float(baseline[which].experiment.order)}
            for which, number in zip(*np.unravel_index(worst, gain.shape), strict=True)
        ]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of beads and experiments."""
        return number_of_beads(experiments) * len(experiments)

    def _misread(self, experiment: Experiment, values: Values) -> BoolArray:
        return np.full(len(experiment.time), experiment.order == round(values["order"]))


class FiducialMisreadFrom(FiducialMisread):
    """From an instant on, to the last experiment: the tracker has jumped to a reflection beside the bead."""

    form = "from_an_instant"
    constants = (bead_constant("bead"), ORDER, TIME)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the beads whose misfit an offset from some instant on lowers most, each with its best instant."""
        ordered = in_order(baseline)
        misfit = np.concatenate([fiducial_misfit(each) for each in ordered])
        rows_left = np.arange(len(misfit), 0, -1)
        gain = (sums_to_the_end(misfit) ** 2).sum(axis=-1) / rows_left[:, None]
        worst = np.argsort(-gain.max(axis=0))[:_TRIED_BEADS]
        return [
            {"bead": float(number), **start_of_row(ordered, int(np.argmax(gain[:, number])))}
            for number in worst
        ]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of beads and rows."""
        return number_of_beads(experiments) * number_of_rows(experiments)

    def _misread(self, experiment: Experiment, values: Values) -> BoolArray:
        return after(experiment, values)


class FiducialMisreadInPart(FiducialMisread):
    """It follows its tissue in part: it slides on the skin, or the tracker clings to where it was."""

    form = "follows_in_part"
    words = "One fiducial follows the tissue only in part."
    amplitudes = (Amplitude("share_behind", "1", scale=0.1, smallest=0.005, lower=-1.0, upper=1.0),)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the beads whose misfit shrinks most where they lag by a share of their way."""
        along, squares = np.zeros((2, number_of_beads([each.experiment for each in baseline])))
        for each in baseline:
            way = each.fiducials - each.experiment.fiducials_rest
            along += np.einsum("nbi,nbi->b", fiducial_misfit(each), way)
            squares += np.einsum("nbi,nbi->b", way, way)
        gain = along**2 / np.maximum(squares, np.finfo(float).tiny)
        return [{"bead": float(number)} for number in np.argsort(-gain)[:_TRIED_BEADS]]

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Leave the bead behind."""
        number, fiducials = bead(values, "bead"), readings.fiducials.copy()
        way = fiducials[:, number] - readings.experiment.fiducials_rest[number]
        fiducials[:, number] -= values["share_behind"] * way
        return readings.with_fiducials(fiducials)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the share of its way by which the bead is behind."""
        return ({"kind": "bead_behind", "bead": bead(values, "bead"), "share": values["share_behind"]},)
