"""The cameras' frame is a similarity off the tissue's: what that makes of the beads' recorded positions.

A laboratory that says "the cameras are off" means that a bead at x is seen at x + M x + t: M is what the label names, a
scale or a turn, and t a shift, for the point about which the frame scales or turns may lie anywhere. What of the beads'
positions came from these cameras is a matter of the laboratory:

* the *readings* alone: the rest positions are a template's, and the beads seem to stand aside already at rest;
* the *motion* alone: the rest positions are a template's, to which the seen motion was added;
* *both*: the same cameras measured the rest positions. The readings agree with these at rest, the motion is off, and
  the beads sit elsewhere in the tissue than stated, where it moves otherwise;
* the *rest* positions alone: other cameras, or the same ones before they were set up again, measured these.
"""

from abc import ABC, abstractmethod
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import AXES
from estimator.effects.shared.sensor_steps import SensorStep, camera_frame
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]
Measured = Literal["readings", "motion", "both", "rest"]
Origin = Literal["of_the_tissue_frame", "anywhere"]

# A scale or turn of its usual size about a point that is 60 mm away.
_SHIFT = tuple(
    Amplitude(f"shift_{axis}", "m", scale=1e-3, smallest=1e-4, lower=-0.05, upper=0.05) for axis in AXES
)


class CameraFrame(Effect, ABC):
    """Cameras that see a bead at x + M x + t; a subclass tells M by its own amplitudes.

    Parameters
    ----------
    form : its name
    measured : what of the beads' positions came from these cameras
    origin : whether t is zero or, with three amplitudes more, anything
    """

    group: ClassVar[Group] = "vision"
    stage: ClassVar[Stage] = "vision"
    acts_on: ClassVar[tuple[Hook, ...]] = ("seen", "readings")
    inexactness: ClassVar[float] = HARDLY_INEXACT
    of_frame: ClassVar[tuple[Amplitude, ...]]

    def __init__(
        self, form: str, measured: Measured = "readings", origin: Origin = "of_the_tissue_frame"
    ) -> None:
        self.form = form
        self.amplitudes = (*self.of_frame, *(_SHIFT if origin == "anywhere" else ()))
        self.rest_seen = measured in ("both", "rest")
        self._measured = measured

    @abstractmethod
    def matrix(self, values: Values) -> FloatArray:
        """Return M (3, 3)."""

    def seen(self, positions: FloatArray, values: Values) -> FloatArray:
        """Return where these cameras see positions (..., 3), m."""
        shift = np.array([values.get(amplitude.name, 0.0) for amplitude in _SHIFT])
        return positions + positions @ self.matrix(values).T + shift

    def readings(self, readings: Readings, values: Values) -> Readings:
        """See the positions, or the motion since rest; nothing where the readings are not these cameras'."""
        if self._measured == "rest":
            return readings
        seen = self.seen(readings.fiducials, values)
        rest = self.seen(readings.rest_fiducials, values)
        if self._measured == "motion":
            return readings.with_fiducials(seen - (rest - readings.rest_fiducials))
        return readings.with_fiducials(seen, rest)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return M and t; nothing where the readings are not these cameras'."""
        if self._measured == "rest":
            return ()
        shift = np.array([values.get(amplitude.name, 0.0) for amplitude in _SHIFT])
        seen: Literal["motion", "positions"] = "motion" if self._measured == "motion" else "positions"
        return (camera_frame(self.matrix(values), shift, seen),)
