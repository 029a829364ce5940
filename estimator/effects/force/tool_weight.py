"""The mass beyond the force sensor is not the stated one."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import AXES, in_tissue_axes
from estimator.effects.shared.of_each_experiment import ReadingsOfEachExperiment
from estimator.effects.shared.sensor_steps import SensorStep
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]


class ToolWeight(Effect):
    """The weight that compensation with the stated mass leaves over, less what zeroing took away.

    In the gripper's axes a mass m with its centre at c weighs W(R) = (m Rᵀg, c × m Rᵀg). The sensor was zeroed at the
    first row, so that the error is ΔW(R) − ΔW(R₁), ΔW being the weight of the true tool less that of the stated one:
    nothing as long as the gripper does not turn against gravity.
    """

    label = "tool_weight"
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    measured_by = "move the empty gripper through four poses in free air"
    words = "The mass beyond the force sensor is not the stated one, which shows when the gripper turns."
    inexactness = HARDLY_INEXACT
    form = "mass"
    amplitudes: tuple[Amplitude, ...] = (Amplitude("mass_error", "kg", scale=0.1, smallest=0.005),)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add the weight left over."""
        mass, moment, gravity = self._left_over(readings.experiment, values)
        down = readings.rotation.inv().apply(gravity)
        weight = np.concatenate([mass * down, np.cross(moment, down)], axis=1)
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, weight - weight[0]))

    def _left_over(self, experiment: Experiment, values: Values) -> tuple[float, FloatArray, FloatArray]:
        """Return mass, kg, first moment (3,), kg·m, and gravity (3,), m/s², of what compensation leaves over."""
        sensor, mass_error = experiment.sensor, values["mass_error"]
        centre = np.asarray(sensor.tool_centre)
        moment = self._moment_error(sensor.tool_mass, centre, mass_error, values)
        return mass_error, moment, np.asarray(experiment.environment.gravity)

    def _moment_error(self, mass: float, centre: FloatArray, mass_error: float, values: Values) -> FloatArray:
        """Return what the first moment of mass (3,) is off by, kg·m."""
        return mass_error * centre

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return mass and first moment of what is left over, and gravity."""
        mass, moment, gravity = self._left_over(experiment, values)
        return (
            {
                "kind": "weight_on_sensor",
                "mass": mass,
                "moment": moment.tolist(),
                "gravity": gravity.tolist(),
            },
        )


class ToolWeightAndCentre(ToolWeight):
    """Its centre of mass is off as well: the first moment is (m + Δm)(c + Δc)."""

    linear = False
    form = "mass_and_centre"
    amplitudes = (
        *ToolWeight.amplitudes,
        *(Amplitude(f"centre_error_{axis}", "m", scale=0.02, smallest=2e-3) for axis in AXES),
    )

    def _moment_error(self, mass: float, centre: FloatArray, mass_error: float, values: Values) -> FloatArray:
        centre_error = np.array([values[f"centre_error_{axis}"] for axis in AXES])
        return mass_error * centre + (mass + mass_error) * centre_error


class TiltedGravity(ToolWeight):
    """The tool is the stated one, and gravity points elsewhere than its compensation supposes: a base that leans.

    ΔW(R) is then the stated tool's weight in the field g' − g, where g' is the stated gravity g turned about two
    horizontal axes (x and y, where g points along −z) by a rotation vector of these amplitudes. A turn about the
    vertical does nothing, and neither does a tool without a stated mass.
    """

    linear = False
    words = (
        "Gravity points elsewhere than the tool's compensation supposes, which shows when the gripper turns."
    )
    form = "tilted_gravity"
    amplitudes = tuple(
        Amplitude(f"tilt_{axis}", "rad", scale=0.05, smallest=5e-3, lower=-1.0, upper=1.0)
        for axis in AXES[:2]
    )

    def _left_over(self, experiment: Experiment, values: Values) -> tuple[float, FloatArray, FloatArray]:
        gravity = np.asarray(experiment.environment.gravity)
        about = np.array([values["tilt_x"], values["tilt_y"], 0.0])
        tilt = Rotation.from_rotvec(_standing(gravity).apply(about))
        mass = experiment.sensor.tool_mass
        return mass, mass * np.asarray(experiment.sensor.tool_centre), tilt.apply(gravity) - gravity


class ToolWeightOfEach(ReadingsOfEachExperiment, ToolWeight):
    """Something was put on the tool, or taken off it, between experiments."""


def _standing(gravity: FloatArray) -> Rotation:
    """Return the shortest turn of −z to where gravity (3,) points; none where there is no gravity."""
    if not gravity.any():
        return Rotation.identity()
    return Rotation.align_vectors(gravity[None], [[0.0, 0.0, -1.0]])[0]
