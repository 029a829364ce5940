"""The cameras' stream lags or leads the pose stream: no label of the catalogue."""

from typing import Literal

from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings, Values
from estimator.effects.shared.instants import at_other_times
from estimator.effects.shared.sensor_steps import SensorStep, delay
from estimator.experiment import Experiment


class CameraLag(Effect):
    """The row of time t holds where the beads were at t − lag (or t + lead).

    Between rows their positions are interpolated. Lag and lead are two forms because positions have a kink wherever
    the gripper starts or stops.
    """

    label = OUTSIDE
    group = "timing"
    stage = "vision"
    acts_on = ("readings",)
    words = "The cameras' images are shifted in time against the pose stream."

    def __init__(self, form: Literal["camera_lag", "camera_lead"]) -> None:
        self.form = form
        self.amplitudes = (Amplitude("shift", "s", scale=0.1, smallest=0.01, lower=0.0),)
        self._sign = -1.0 if form == "camera_lag" else 1.0

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Shift the beads' tracks in time."""
        time = readings.experiment.time
        tracks = readings.fiducials.reshape(len(time), -1)
        shifted = at_other_times(time, tracks, self._sign * values["shift"])
        return readings.with_fiducials(shifted.reshape(readings.fiducials.shape))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the shift in time."""
        return (delay("beads", -self._sign * values["shift"]),)
