"""The gripper's direction of motion is turned against the tissue frame."""

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Motion, Values
from estimator.effects.shared.axes import AXES
from estimator.effects.shared.of_each_experiment import MotionOfEachExperiment


class MotionDirection(Effect):
    """True displacement from rest = Q times the reported one; the orientation is true.

    The amplitudes are the rotation vector of Q in tissue axes: an error of the hand-eye registration.
    """

    label = "motion_direction"
    group = "robot"
    stage = "motion"
    acts_on = ("motion",)
    measured_by = "move the empty gripper in view of the cameras"
    words = "The gripper's direction of motion is turned against the tissue frame."
    inexactness = HARDLY_INEXACT
    form = "translation"
    amplitudes = tuple(
        Amplitude(f"rotation_{axis}", "rad", scale=0.04, smallest=3e-3, lower=-1.0, upper=1.0)
        for axis in AXES
    )

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Turn the displacement."""
        displacement = motion.position - np.asarray(motion.experiment.grasp.centre)
        change = self._turn(values).as_matrix() - np.eye(3)
        return motion.moved(motion.position + displacement @ change.T)

    def _turn(self, values: Values) -> Rotation:
        return Rotation.from_rotvec(np.array([values[amplitude.name] for amplitude in self.amplitudes]))


class PoseDirection(MotionDirection):
    """The axis of the gripper's rotation is turned as well: R becomes Q R Qᵀ."""

    form = "translation_and_rotation"

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Turn displacement and axis of rotation."""
        moved, turn = super().motion(motion, values), self._turn(values)
        return moved.moved(moved.position, turn * motion.rotation * turn.inv())


class TurnDirection(MotionDirection):
    """The axis of the gripper's rotation alone is turned, as by a wrist that was set askew: R becomes Q R Qᵀ."""

    form = "rotation"

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Turn the axis of rotation; the way is true."""
        turn = self._turn(values)
        return motion.moved(motion.position, turn * motion.rotation * turn.inv())


class MotionDirectionOfEach(MotionOfEachExperiment, MotionDirection):
    """The robot was registered anew before each experiment, or its base was knocked."""
