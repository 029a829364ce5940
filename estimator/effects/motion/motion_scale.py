"""The gripper moves a little more or less than reported."""

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Motion, Values
from estimator.effects.shared.axes import AXES
from estimator.effects.shared.of_each_experiment import MotionOfEachExperiment


class MotionScale(Effect):
    """True displacement from rest = (1 + s) times the reported one; the orientation is true."""

    label = "motion_scale"
    group = "robot"
    stage = "motion"
    acts_on = ("motion",)
    linear = True
    measured_by = "move the empty gripper in view of the cameras"
    words = "The gripper moves a little more or less than reported."
    inexactness = HARDLY_INEXACT
    form = "translation"
    amplitudes: tuple[Amplitude, ...] = (
        Amplitude("scale_error", "1", scale=0.03, smallest=2e-3, lower=-0.5),
    )

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Scale the displacement."""
        displacement = motion.position - np.asarray(motion.experiment.grasp.centre)
        return motion.moved(motion.position + values["scale_error"] * displacement)


class PoseScale(MotionScale):
    """The angle of rotation from rest is scaled as well."""

    form = "translation_and_rotation"

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Scale displacement and rotation."""
        moved = super().motion(motion, values)
        return moved.moved(moved.position, _surplus(motion, values) * motion.rotation)


class TurnScale(MotionScale):
    """The angle of rotation from rest alone is scaled, as by the last joint: R becomes R^(1 + s); the way is true."""

    form = "rotation"

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Scale the rotation."""
        return motion.moved(motion.position, _surplus(motion, values) * motion.rotation)


class AxisScale(MotionScale):
    """Each axis of the tissue frame has a scale of its own: gears, or axes of a gantry, that differ."""

    form = "by_axis"
    elaborates = "translation"
    amplitudes = tuple(
        Amplitude(f"scale_error_{axis}", "1", scale=0.03, smallest=2e-3, lower=-0.5) for axis in AXES
    )

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Scale the displacement along each axis."""
        displacement = motion.position - np.asarray(motion.experiment.grasp.centre)
        errors = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        return motion.moved(motion.position + errors * displacement)


class MotionScaleOfEach(MotionOfEachExperiment, MotionScale):
    """The robot was calibrated anew before each experiment."""


def _surplus(motion: Motion, values: Values) -> Rotation:
    """Return the turns (n) beyond the reported ones, about their axes."""
    return Rotation.from_rotvec(values["scale_error"] * motion.rotation.as_rotvec())
