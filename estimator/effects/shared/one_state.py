"""What effects of motion and sensors do to the prediction of one state, to first order in the gripper's motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Effect, Motion, Readings, Values
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.equilibrium.observation import Observation

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OneState:
    """A state of an experiment.

    Attributes
    ----------
    experiment : as it was recorded
    rest, pose : the gripper's, where it was at rest and in this state
    observation : the prediction of the state, with its derivatives by the pose
    """

    experiment: Experiment
    rest: GripperPose
    pose: GripperPose
    observation: Observation


def change_of_channels(state: OneState, acting: Sequence[tuple[Effect, Values]]) -> FloatArray:
    """Return by how much effects at given values change wrench and fiducials, (6 + 3m,).

    The gripper's way begins where it was at rest. What cameras distort is seen from the middle of the beads at rest:
    where they are is measured there.
    """
    x, y, z = state.rest.position.tolist()
    began = replace(state.experiment, grasp=replace(state.experiment.grasp, centre=(x, y, z)))
    position, still = state.pose.position[None], np.zeros((1, 6))
    moving = Motion(began, position, Rotation.concatenate([state.pose.rotation]), still, still, np.zeros(1))
    felt = state.observation.wrench[None]
    rest = state.experiment.fiducials_rest
    arms = (state.observation.fiducials - rest.sum(axis=0) / max(len(rest), 1))[None]
    read = Readings(began, position, moving.rotation, position, felt, arms, felt[0], arms[0])
    motion, readings = moving, read
    for effect, values in acting:
        motion, readings = effect.motion(motion, values), effect.readings(readings, values)
    turn = (motion.rotation * moving.rotation.inv()).as_rotvec()
    shift = np.hstack([motion.position - position, turn])[0]
    wrench = readings.wrench[0] - felt[0] + state.observation.wrench_by_pose @ shift
    fiducials = readings.fiducials[0] - arms[0] + state.observation.fiducials_by_pose @ shift
    return np.concatenate([wrench, fiducials.reshape(-1)])
