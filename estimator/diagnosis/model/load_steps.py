"""The time_points of a retraction in time: stays of the gripper at one pose, and the rows that see each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.experiment import Experiment
from estimator.forward.schedule import PoseSchedule, schedule_poses

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class LoadSteps:
    """The time_points of one experiment, in time.

    Unlike the states of a :class:`PoseSchedule`, a pose to which the gripper returns is another load step: tissue that
    remembers answers differently then.

    Attributes
    ----------
    experiment : Experiment
    position : (v, 3) reported origin of the gripper frame, mean over all rows of that pose, m
    rotation : v rotations
    pose_variance : (v, 6) of that mean pose, m² and rad²
    time : (v,) of the first row, s
    of_row : (n,) load step of each row
    load : (v, 6) wrench of the tissue on the gripper, mean over its rows, relative to the first one
    """

    experiment: Experiment
    position: FloatArray
    rotation: Rotation
    pose_variance: FloatArray
    time: FloatArray
    of_row: IntArray
    load: FloatArray

    def __len__(self) -> int:
        return len(self.time)

    @property
    def off_rest(self) -> FloatArray:
        """By what the first reported pose, at rest but for its noise, is off the stated rest pose, (6,) m and rad.

        Where it is under load it is itself where force and torque are counted from.
        """
        shift = self.position[0] - np.asarray(self.experiment.grasp.centre)
        off = np.concatenate([shift, self.rotation[0].as_rotvec()])
        return np.where(self.experiment.first_row == "under_load", 0.0, off)


def load_steps_of(experiment: Experiment, felt: FloatArray) -> LoadSteps:
    """Group consecutive rows that share a pose; ``felt`` (n, 6) is the wrench of the tissue on the gripper."""
    schedule = schedule_poses(experiment)
    new = np.diff(schedule.state_of_row, prepend=-1) != 0
    return _load_steps(experiment, felt, schedule, np.cumsum(new) - 1)


def rows_as_load_steps(experiment: Experiment, felt: FloatArray) -> LoadSteps:
    """Take every row as a load step of its own, for tissue that changes while the gripper stands."""
    return _load_steps(experiment, felt, schedule_poses(experiment), np.arange(len(experiment.time)))


def _load_steps(
    experiment: Experiment, felt: FloatArray, schedule: PoseSchedule, of_row: IntArray
) -> LoadSteps:
    _, first = np.unique(of_row, return_index=True)
    state = schedule.state_of_row[first]
    rotations = Rotation.concatenate([pose.rotation for pose in schedule.poses])
    load = np.zeros((len(first), 6))
    np.add.at(load, of_row, felt)
    load /= np.bincount(of_row)[:, None]
    return LoadSteps(
        experiment,
        np.array([schedule.poses[s].position for s in state]),
        rotations[state],
        experiment.sensor.pose_std**2 / schedule.rows_per_state[state][:, None],
        experiment.time[first],
        of_row,
        load - load[0],
    )
