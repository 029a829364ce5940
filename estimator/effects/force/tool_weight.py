"""The mass beyond the force sensor is not the stated one."""

import numpy as np
from numpy.typing import NDArray

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
        sensor, gravity = readings.experiment.sensor, np.asarray(readings.experiment.environment.gravity)
        down = readings.rotation.inv().apply(gravity)
        mass_error = values["mass_error"]
        moment_error = self._moment_error(
            sensor.tool_mass, np.asarray(sensor.tool_centre), mass_error, values
        )
        weight = np.concatenate([mass_error * down, np.cross(moment_error, down)], axis=1)
        return readings.with_wrench(readings.wrench + in_tissue_axes(readings.rotation, weight - weight[0]))

    def _moment_error(self, mass: float, centre: FloatArray, mass_error: float, values: Values) -> FloatArray:
        """Return what the first moment of mass (3,) is off by, kg·m."""
        return mass_error * centre

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return mass and first moment of what is left over, and gravity."""
        sensor, mass_error = experiment.sensor, values["mass_error"]
        centre = np.asarray(sensor.tool_centre)
        return (
            {
                "kind": "weight_on_sensor",
                "mass": mass_error,
                "moment": self._moment_error(sensor.tool_mass, centre, mass_error, values).tolist(),
                "gravity": list(experiment.environment.gravity),
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


class ToolWeightOfEach(ReadingsOfEachExperiment, ToolWeight):
    """Something was put on the tool, or taken off it, between experiments."""
