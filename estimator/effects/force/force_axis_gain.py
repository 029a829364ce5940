"""One axis of the force sensor reads too much or too little."""

import numpy as np

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import WRENCH_CHANNELS, in_gripper_axes, in_tissue_axes
from estimator.effects.shared.sensor_steps import SensorStep, linear_wrench
from estimator.experiment import Experiment


class ForceAxisGain(Effect):
    """Reported component = (1 + gain) times the true one, for one axis of the sensor, which turns with the gripper.

    A gain that all axes have in common is no effect: it is Young's modulus.
    """

    label = "force_axis_gain"
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    measured_by = "hang a known weight on the gripper along each axis"
    words = "One axis of the force sensor reads too much or too little in proportion to its load."
    inexactness = HARDLY_INEXACT
    amplitudes = (Amplitude("gain", "1", scale=0.08, smallest=0.01, lower=-1.0),)

    def __init__(self, channel: str) -> None:
        self.form = channel
        self._unit = np.eye(6)[WRENCH_CHANNELS.index(channel)]

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the component."""
        surplus = values["gain"] * self._unit * in_gripper_axes(readings.rotation, readings.wrench)
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, surplus))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the gain."""
        return (linear_wrench("gripper", np.eye(6) + values["gain"] * np.diag(self._unit)),)
