"""Errors of sensors and motion that the model does not have, and what each of them would do to the channels.

They are effects of the catalogue at 1 %: a fit is asked how much of each its parameters would take up.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Motion, Readings
from estimator.effects.force.force_axis_gain import ForceAxisGain
from estimator.effects.motion.motion_scale import MotionScale
from estimator.effects.shared.axes import WRENCH_CHANNELS
from estimator.effects.vision.camera_scale import CameraScale
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.equilibrium.observation import Observation
from estimator.fit.residuals import StateMean, channels_by_position
from estimator.forward.schedule import PoseSchedule

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Confounder:
    """An error of a sensor or of the motion that the model does not have.

    Attributes
    ----------
    name, size : in words
    change : from a state of an experiment, the gripper's pose there and at rest, and the prediction, the change (c,)
        of its channels
    """

    name: str
    size: str
    change: Callable[[Experiment, GripperPose, GripperPose, Observation], FloatArray]


# What each of them is taken to be off by, and how that is told.
_OFF = 0.01
_SIZE = "1 %"


def _force_gain(
    experiment: Experiment, pose: GripperPose, rest: GripperPose, observation: Observation
) -> FloatArray:
    """Return what the same gain on every axis does, which is no effect of its own: it is Young's modulus."""
    del rest
    felt, fiducials = observation.wrench[None], observation.fiducials[None]
    readings = Readings(
        experiment,
        pose.position[None],
        Rotation.concatenate([pose.rotation]),
        pose.position[None],
        felt,
        fiducials,
        observation.wrench,
        observation.fiducials,
    )
    gains = [ForceAxisGain(channel) for channel in WRENCH_CHANNELS]
    off = [gain.readings(readings, {gain.amplitudes[0].name: _OFF}).wrench - felt for gain in gains]
    return np.concatenate([np.sum(off, axis=0)[0], np.zeros(observation.fiducials.size)])


def _camera_scale(
    experiment: Experiment, pose: GripperPose, rest: GripperPose, observation: Observation
) -> FloatArray:
    """Return what a scale about the middle of the beads at rest does: where they are is measured there."""
    del pose, rest
    scale = CameraScale()
    arms = observation.fiducials - experiment.fiducials_rest.mean(axis=0)
    off = scale.seen(arms, {scale.amplitudes[0].name: _OFF}) - arms
    return np.concatenate([np.zeros(6), off.reshape(-1)])


def _travel(
    experiment: Experiment, pose: GripperPose, rest: GripperPose, observation: Observation
) -> FloatArray:
    """Return what a scale of the way from where the gripper was at rest does, to first order."""
    scale = MotionScale()
    x, y, z = rest.position.tolist()
    began = replace(experiment, grasp=replace(experiment.grasp, centre=(x, y, z)))
    still = np.zeros((1, 6))
    motion = Motion(began, pose.position[None], pose.rotation, still, still, np.zeros(1))
    off = scale.motion(motion, {scale.amplitudes[0].name: _OFF}).position[0] - pose.position
    return np.asarray(channels_by_position(observation) @ off)


CONFOUNDERS = (
    Confounder("force gain", _SIZE, _force_gain),
    Confounder("camera scale", _SIZE, _camera_scale),
    Confounder("gripper travel", _SIZE, _travel),
)


def confounder_columns(
    experiments: Sequence[Experiment], schedules: Sequence[PoseSchedule]
) -> Callable[[StateMean, Observation], FloatArray]:
    """Return the function that gives a state's change (c, k) by every confounder."""

    def columns(mean: StateMean, observation: Observation) -> FloatArray:
        experiment, poses = experiments[mean.experiment], schedules[mean.experiment].poses
        return np.stack(
            [c.change(experiment, poses[mean.state], poses[0], observation) for c in CONFOUNDERS], axis=1
        )

    return columns
