"""Torques are about another point than stated."""

from typing import Literal

import numpy as np

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import AXES
from estimator.effects.shared.of_each_experiment import ReadingsOfEachExperiment
from estimator.effects.shared.sensor_steps import SensorStep, linear_wrench, mount_that_gives
from estimator.experiment import Experiment

Frame = Literal["gripper", "tissue"]


class TorqueCentre(Effect):
    """Torques are about a point at d from the gripper frame's origin, not about that: T' = T − d × F.

    A sensor's centre that is stated wrongly turns along, as R d; a lever that software adds after it has turned the
    wrench into tissue axes stays d.

    Parameters
    ----------
    frame : in which d is constant
    """

    label = "torque_centre"
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    words = "Torques are about another point than the stated origin of the gripper frame."
    inexactness = HARDLY_INEXACT
    amplitudes = tuple(Amplitude(f"centre_{axis}", "m", scale=4e-3, smallest=5e-4) for axis in AXES)

    def __init__(self, frame: Frame) -> None:
        self.form = f"{frame}_frame"
        self._turns = frame == "gripper"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Move the torques to the other point."""
        centre = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        wrench = readings.wrench.copy()
        lever = readings.rotation.apply(centre) if self._turns else centre
        wrench[:, 3:] -= np.cross(lever, wrench[:, :3])
        return readings.with_wrench(wrench)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the lever."""
        x, y, z = (values[amplitude.name] for amplitude in self.amplitudes)
        matrix = np.eye(6)
        matrix[3:, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        return (linear_wrench("sensor" if self._turns else "tissue", matrix),)


class TorqueCentreThatGives(TorqueCentre):
    """The point moves with the load, as d = |F| e with e constant in the gripper's axes: T' = T − |F| R e × F."""

    elaborates = "gripper_frame"
    words = "The point that torques are about moves with the load."
    amplitudes = tuple(
        Amplitude(f"centre_per_force_{axis}", "m/N", scale=2e-3, smallest=2.5e-4) for axis in AXES
    )

    def __init__(self) -> None:
        super().__init__("gripper")
        self.form = "in_proportion_to_load"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Move the torques to the point where it is under this load."""
        given = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        wrench = readings.wrench.copy()
        load = np.linalg.norm(wrench[:, :3], axis=1, keepdims=True)
        wrench[:, 3:] -= load * np.cross(readings.rotation.apply(given), wrench[:, :3])
        return readings.with_wrench(wrench)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the lever per newton."""
        return (mount_that_gives(lever=[values[amplitude.name] for amplitude in self.amplitudes]),)


class TorqueCentreOfEach(ReadingsOfEachExperiment, TorqueCentre):
    """The sensor was fixed anew before each experiment."""
