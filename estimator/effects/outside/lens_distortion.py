"""The cameras' lenses distort the beads' plane: no label of the catalogue."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings, Values
from estimator.effects.shared.zeroing import with_fiducials_zeroed

FloatArray = NDArray[np.float64]


class LensDistortion(Effect):
    """In the plane a bead at x is seen at x + k r² x + 2 (p · x) x + r² p (Brown 1971): radial, and decentred by p.

    Either the stated rest positions are true, or the same cameras measured them, so that only motion is distorted.
    """

    label = OUTSIDE
    group = "vision"
    stage = "vision"
    acts_on = ("readings",)
    linear = True
    words = "The cameras' lenses distort the plane of the beads."
    amplitudes = (
        Amplitude("radial", "1/m2", scale=4.0, smallest=0.3),
        Amplitude("decentring_x", "1/m", scale=0.1, smallest=0.01),
        Amplitude("decentring_y", "1/m", scale=0.1, smallest=0.01),
    )

    def __init__(self, rest: Literal["true", "measured"]) -> None:
        self.form = f"lens_distortion_rest_{rest}"
        self._rest_is_measured = rest == "measured"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Distort the positions."""
        distorted = readings.with_fiducials(_distorted(readings.fiducials, values))
        if not self._rest_is_measured:
            return distorted
        rest = _distorted(readings.rest_fiducials, values)
        return with_fiducials_zeroed(replace(distorted, rest_fiducials=rest))


def _distorted(positions: FloatArray, values: Values) -> FloatArray:
    """Return where beads at positions (..., 3) are seen."""
    x = positions[..., :2]
    decentring = np.array([values["decentring_x"], values["decentring_y"]])
    square = (x**2).sum(axis=-1, keepdims=True)
    along = (x @ decentring)[..., None]
    seen = positions.copy()
    seen[..., :2] += values["radial"] * square * x + 2.0 * along * x + square * decentring
    return seen
