"""A force axis ends its range too early: no label of the catalogue."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.axes import in_gripper_axes, in_tissue_axes
from estimator.effects.shared.misfit import measured_or_predicted
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

_AXES = 3
_SHARES = tuple(np.linspace(0.5, 0.98, 13))
_TRIED = 2


class ForceClipping(Effect):
    """Beyond a limit one force axis of the sensor shows only a part of the excess, or nothing of it.

    An amplifier that saturates does so at one value, whatever the sensor's data sheet says of its range.
    """

    label = OUTSIDE
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    words = "One force axis saturates before the end of its range."
    form = "force_clipping"
    amplitudes = (Amplitude("lost_share", "1", scale=0.6, smallest=0.05, lower=0.0, upper=1.0),)
    constants = (
        Constant("axis", "1", (), 0.0, _AXES - 1.0, fixed=True),
        Constant("limit", "N", (), 0.0, np.inf, fixed=True),
    )

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the axes and limits that explain most of the misfit."""
        felt = [in_gripper_axes(each.rotation, each.wrench)[:, :_AXES] for each in baseline]
        read = [in_gripper_axes(each.rotation, measured_or_predicted(each))[:, :_AXES] for each in baseline]
        force, error = np.concatenate(felt), np.concatenate(read) - np.concatenate(felt)
        found = []
        for axis in range(_AXES):
            largest = float(np.abs(force[:, axis]).max())
            for share in _SHARES:
                lost = -_beyond(force[:, axis], share * largest)
                gain = max(float(lost @ error[:, axis]), 0.0) ** 2 / max(float(lost @ lost), 1e-300)
                found.append((gain, {"axis": float(axis), "limit": share * largest}))
        found.sort(key=lambda item: -item[0])
        return [start for _, start in found[:_TRIED]]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of axes and limits."""
        return _AXES * len(_SHARES)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the excess away."""
        axis = round(values["axis"])
        felt = in_gripper_axes(readings.rotation, readings.wrench)
        lost = np.zeros_like(felt)
        lost[:, axis] = -values["lost_share"] * _beyond(felt[:, axis], values["limit"])
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, lost))


def _beyond(force: FloatArray, limit: float) -> FloatArray:
    """Return what a force (n,) has beyond a limit of either sign, N."""
    return np.asarray(np.sign(force) * np.maximum(np.abs(force) - limit, 0.0))
