"""The force sensor is mounted rotated against the gripper frame."""

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import AXES, Frame, in_gripper_axes, in_tissue_axes, turned
from estimator.effects.shared.of_each_experiment import ReadingsOfEachExperiment
from estimator.effects.shared.sensor_steps import SensorStep, linear_wrench, mount_that_gives
from estimator.experiment import Experiment


class ForceFrameRotation(Effect):
    """A sensor that sits turned by Q in the gripper reads Qᵀ w for the wrench w in the gripper's axes.

    The amplitudes are the rotation vector of Q in the gripper's axes. The origin of both frames is the same. Where the
    turn from the robot's base to the tissue is wrong instead, the wrench is turned by Q in the tissue's axes, whatever
    the gripper does.

    Parameters
    ----------
    frame : whose axes Q is constant in
    """

    label = "force_frame_rotation"
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    measured_by = "hang a known weight on the gripper in three poses"
    words = "The force sensor is mounted rotated against the gripper."
    inexactness = HARDLY_INEXACT
    amplitudes = tuple(
        Amplitude(f"rotation_{axis}", "rad", scale=0.06, smallest=0.005, lower=-1.0, upper=1.0)
        for axis in AXES
    )

    def __init__(self, frame: Frame = "sensor") -> None:
        self.form = "" if frame == "sensor" else f"{frame}_frame"
        self._turns = frame == "sensor"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the components along the sensor's axes for those along the gripper's."""
        mounting = Rotation.from_rotvec(np.array([values[amplitude.name] for amplitude in self.amplitudes]))
        if not self._turns:
            return readings.with_wrench(turned(mounting.inv(), readings.wrench))
        wrench = in_gripper_axes(readings.rotation, readings.wrench)
        change = turned(mounting.inv(), wrench) - wrench
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, change))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the turn of force and torque alike."""
        mounting = Rotation.from_rotvec(np.array([values[amplitude.name] for amplitude in self.amplitudes]))
        frame: Frame = "sensor" if self._turns else "tissue"
        return (linear_wrench(frame, np.kron(np.eye(2), mounting.inv().as_matrix())),)


class ForceFrameThatGives(ForceFrameRotation):
    """The mount gives under the load: the sensor's rotation vector is |F| times one in rad/N, in the gripper's axes."""

    # Looked for where any form of the label leads: the plain one has no name.
    elaborates = "tissue_frame"
    words = "The force sensor's mount gives, so that it turns against the gripper under load."
    amplitudes = tuple(
        Amplitude(f"rotation_per_force_{axis}", "rad/N", scale=0.03, smallest=2.5e-3) for axis in AXES
    )

    def __init__(self) -> None:
        super().__init__("sensor")
        self.form = "in_proportion_to_load"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the components along the axes that the sensor has under this load."""
        wrench = in_gripper_axes(readings.rotation, readings.wrench)
        given = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        mounting = Rotation.from_rotvec(np.outer(np.linalg.norm(wrench[:, :3], axis=1), given))
        change = turned(mounting.inv(), wrench) - wrench
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, change))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the turn per newton."""
        return (mount_that_gives(rotation=[values[amplitude.name] for amplitude in self.amplitudes]),)


class ForceFrameRotationOfEach(ReadingsOfEachExperiment, ForceFrameRotation):
    """The sensor was fixed anew before each experiment."""
