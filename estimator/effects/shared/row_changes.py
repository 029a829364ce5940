"""What effects of motion and sensors do to the prediction of an experiment, to first order in the gripper's motion."""

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
class PredictedRows:
    """An experiment with the prediction of each of its n rows; the first is at rest.

    Attributes
    ----------
    experiment : as it was recorded
    poses : n, of the gripper
    observations : n, with their derivatives by the pose
    """

    experiment: Experiment
    poses: Sequence[GripperPose]
    observations: Sequence[Observation]


def change_of_rows(predicted: PredictedRows, acting: Sequence[tuple[Effect, Values]]) -> FloatArray:
    """Return by how much effects at given values change wrench and fiducials, (n, 6 + 3m).

    The gripper's way begins where it was at rest. What cameras distort is seen from the middle of the beads at rest:
    where they are is measured there.
    """
    experiment, poses = predicted.experiment, predicted.poses
    x, y, z = poses[0].position.tolist()
    began = replace(experiment, grasp=replace(experiment.grasp, centre=(x, y, z)))
    position = np.array([pose.position for pose in poses])
    rotation = Rotation.concatenate([pose.rotation for pose in poses])
    still = np.zeros((len(poses), 6))
    moving = Motion(began, position, rotation, still, still, experiment.time)
    felt = np.array([one.wrench for one in predicted.observations])
    rest = experiment.fiducials_rest
    arms = np.array([one.fiducials for one in predicted.observations]) - rest.sum(axis=0) / max(len(rest), 1)
    read = Readings(began, position, rotation, position, felt, arms, felt[0], arms[0])
    motion, readings = moving, read
    for effect, values in acting:
        motion, readings = effect.motion(motion, values), effect.readings(readings, values)
    turn = (motion.rotation * rotation.inv()).as_rotvec()
    shift = np.hstack([motion.position - position, turn])
    by_pose = np.array([one.wrench_by_pose for one in predicted.observations])
    wrench = readings.wrench - felt + np.einsum("nij,nj->ni", by_pose, shift)
    by_pose = np.array([one.fiducials_by_pose for one in predicted.observations])
    fiducials = readings.fiducials - arms + np.einsum("nmij,nj->nmi", by_pose, shift)
    return np.hstack([wrench, fiducials.reshape(len(poses), -1)])
