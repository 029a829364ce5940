"""One axis of the force sensor leaks into another."""

import itertools
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.axes import (
    WRENCH_CHANNELS,
    Frame,
    changed_in,
    in_gripper_axes,
    in_tissue_axes,
)
from estimator.effects.shared.largest_load import LARGEST_LOAD, largest_loads
from estimator.effects.shared.misfit import wrench_misfit
from estimator.effects.shared.sensor_steps import SensorStep, linear_wrench, power_of_load
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

# Cross-talk is a share of the full scales: those of torque and force are 10 N·m and 130 N (ATI Gamma SI-130-10).
_LEVER_M = 10.0 / 130.0
_FULL_SCALE = np.array(3 * [1.0] + 3 * [_LEVER_M])
_LEAK_SCALE = 0.03
_LEAK_SMALLEST = 0.005
_PAIRS = tuple(itertools.permutations(range(6), 2))
_TRIED_PAIRS = 4


class ForceCrosstalk(Effect):
    """Every axis leaks into every other: w' = w + C w in the sensor's axes, with no diagonal in C.

    The entries of C are counted as shares of full scale: C_ij = leak_ij s_i/s_j. A matrix that was applied to the
    wrench in the tissue's axes leaks there.
    """

    label = "force_crosstalk"
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    measured_by = "hang a known weight on the gripper in three poses"
    words = "Load along one axis of the force sensor shows on another."
    inexactness = HARDLY_INEXACT
    form = "all_axes"
    frame: ClassVar[Frame] = "sensor"
    amplitudes: tuple[Amplitude, ...] = tuple(
        Amplitude(f"{WRENCH_CHANNELS[j]}_into_{WRENCH_CHANNELS[i]}", "1", _LEAK_SCALE, _LEAK_SMALLEST)
        for j, i in _PAIRS
    )

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add what leaks."""
        leak = self._leak(values)
        return readings.with_wrench(changed_in(self.frame, readings.rotation, readings.wrench, leak))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return what leaks."""
        return (linear_wrench(self.frame, np.eye(6) + self._leak(values)),)

    def _leak(self, values: Values) -> FloatArray:
        """Return C (6, 6)."""
        leak = np.zeros((6, 6))
        for (j, i), amplitude in zip(_PAIRS, self.amplitudes, strict=True):
            leak[i, j] = values[amplitude.name]
        return leak * _FULL_SCALE[:, None] / _FULL_SCALE


class ForceCrosstalkInTissue(ForceCrosstalk):
    """The axes that leak are those of the tissue: a calibration was applied after the wrench had been turned."""

    form = "all_axes_tissue_frame"
    elaborates = "all_axes"
    frame: ClassVar[Frame] = "tissue"


class ForcePairCrosstalk(ForceCrosstalk):
    """Only one axis leaks, into one other."""

    form = "one_pair"
    amplitudes = (Amplitude("leak", "1", _LEAK_SCALE, _LEAK_SMALLEST),)
    constants: tuple[Constant, ...] = (
        Constant("source", "1", (), 0.0, 5.0, fixed=True),
        Constant("target", "1", (), 0.0, 5.0, fixed=True),
    )

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the pairs that would take most off the misfit."""
        return [{"source": float(j), "target": float(i)} for j, i in _likely_pairs(baseline, 1)]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of ordered pairs of axes."""
        return len(_PAIRS)

    def _leak(self, values: Values) -> FloatArray:
        leak = np.zeros((6, 6))
        leak[round(values["target"]), round(values["source"])] = values["leak"]
        return leak * _FULL_SCALE[:, None] / _FULL_SCALE


class ForcePairCrosstalkThatBends(ForcePairCrosstalk):
    """What leaks from one axis into one other goes with the square of the load: w'_i = w_i + leak s_i/s_j w_j²/L.

    An axis whose beam bends shortens either way it is loaded. L is the largest load that is predicted on the axis that
    leaks, so that the leak is the share there; it is a constant of the search and is told with the result.
    """

    form = "one_pair_bent"
    elaborates = "one_pair"
    constants = (*ForcePairCrosstalk.constants, LARGEST_LOAD)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the pairs that would take most off the misfit, with the largest load."""
        loads = largest_loads(baseline)
        return [
            {"source": float(j), "target": float(i), LARGEST_LOAD.name: loads[j]}
            for j, i in _likely_pairs(baseline, 2)
            if loads[j]
        ]

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add what leaks."""
        source, target = round(values["source"]), round(values["target"])
        load = in_gripper_axes(readings.rotation, readings.wrench)[:, source]
        change = np.zeros_like(readings.wrench)
        change[:, target] = self._leak(values)[target, source] * load**2 / values[LARGEST_LOAD.name]
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, change))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the square of the load."""
        source, target = round(values["source"]), round(values["target"])
        share = self._leak(values)[target, source] / values[LARGEST_LOAD.name]
        return (power_of_load(source, target, 2, share),)


def _likely_pairs(baseline: Sequence[Readings], power: int) -> list[tuple[int, int]]:
    """Return the pairs of axes, the one that leaks first, of which a power of the load takes most off the misfit."""
    load = np.concatenate([in_gripper_axes(each.rotation, each.wrench) for each in baseline]) ** power
    misfit = np.concatenate([wrench_misfit(each) for each in baseline])
    gain = (misfit.T @ load) ** 2 / np.maximum((load**2).sum(axis=0), 1e-300)
    return sorted(_PAIRS, key=lambda pair: -gain[pair[1], pair[0]])[:_TRIED_PAIRS]
