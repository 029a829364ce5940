"""The cameras' frame lies aside of the tissue's: no label of the catalogue."""

import numpy as np

from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import AXES
from estimator.effects.shared.sensor_steps import SensorStep, camera_frame
from estimator.experiment import Experiment


class CameraShift(Effect):
    """All beads seem to lie aside by the same, from the first row of the first experiment on.

    A scale or a turn about a point far away is a shift, too: without this form either would be named for one.
    """

    label = OUTSIDE
    group = "vision"
    stage = "vision"
    acts_on = ("readings",)
    linear = True
    words = "The cameras' frame lies aside of the tissue frame."
    form = "camera_shift"
    amplitudes = tuple(Amplitude(f"shift_{axis}", "m", scale=1e-3, smallest=1e-4) for axis in AXES)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Shift the positions."""
        shift = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        return readings.with_fiducials(readings.fiducials + shift, readings.rest_fiducials + shift)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the shift."""
        shift = [values[amplitude.name] for amplitude in self.amplitudes]
        return (camera_frame(np.zeros((3, 3)), shift, "positions"),)
