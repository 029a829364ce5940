"""Which poses of the gripper have to be solved for an experiment.

The reported pose carries noise of a known size, and a retraction returns to poses where it has been. Rows whose
poses agree within that noise share one state, at their mean pose: its error is smaller than that of any single row.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Two readings of one pose differ by less than this many standard deviations of a coordinate, 999 times in 1000.
_AGREEMENT = 6.0
# A rotation counts as the motion that it gives a point at this distance from the gripper frame's origin, m.
_LEVER_M = 0.01


@dataclass(frozen=True)
class PoseSchedule:
    """The states of an experiment.

    Attributes
    ----------
    poses : the s distinct poses, in the order of their first row
    state_of_row : (n,) int64
    rows_per_state : (s,) int64
    """

    poses: tuple[GripperPose, ...]
    state_of_row: IntArray
    rows_per_state: IntArray


def schedule_poses(experiment: Experiment) -> PoseSchedule:
    """Group the rows of an experiment into states."""
    position, quaternion = (
        np.asarray(each, dtype=np.float64) for each in (experiment.position, experiment.quaternion_wxyz)
    )
    return _schedule(position.tobytes(), quaternion.tobytes(), float(experiment.sensor.position_std))


@lru_cache(maxsize=32)
def _schedule(positions: bytes, quaternions_wxyz: bytes, position_std: float) -> PoseSchedule:
    """Group rows by their poses: those of an experiment are asked for over and over."""
    position = np.frombuffer(positions).reshape(-1, 3)
    rotation = Rotation.from_quat(np.frombuffer(quaternions_wxyz).reshape(-1, 4), scalar_first=True)
    quaternion = rotation.as_quat()
    tolerance = _tolerance(position, quaternion, position_std)
    leaders: list[int] = []
    state_of_row = np.empty(len(position), dtype=np.int64)
    for row in range(len(position)):
        if leaders:
            distances = _distance(position[leaders], quaternion[leaders], position[row], quaternion[row])
            nearest = int(np.argmin(distances))
            if distances[nearest] <= tolerance:
                state_of_row[row] = nearest
                continue
        state_of_row[row] = len(leaders)
        leaders.append(row)
    poses = []
    for state in range(len(leaders)):
        rows = np.flatnonzero(state_of_row == state)
        poses.append(GripperPose(position[rows].mean(axis=0), rotation[rows].mean()))
    return PoseSchedule(tuple(poses), state_of_row, np.bincount(state_of_row, minlength=len(leaders)))


def spread_states(schedule: PoseSchedule, count: int) -> list[int]:
    """Return up to ``count`` states spread evenly along the motion, the farthest among them, in its order."""
    way = travel(schedule)
    wanted = np.linspace(0.0, way.max(), count + 1)[1:]
    return sorted({int(np.argmin(np.abs(way - w))) for w in wanted})


def travel(schedule: PoseSchedule) -> FloatArray:
    """Return how far each state lies from the first, m; rotations count by their lever."""
    origin = schedule.poses[0]
    return np.array([_length(origin.increment_to(pose)) for pose in schedule.poses])


def _tolerance(position: FloatArray, quaternion: FloatArray, position_std: float) -> float:
    steps = _distance(position[1:], quaternion[1:], position[:-1], quaternion[:-1])
    noise = _AGREEMENT * position_std
    moved = steps[steps > noise]
    return min(noise, 0.3 * float(np.median(moved))) if len(moved) else noise


def _distance(position: FloatArray, quaternion: FloatArray, at: FloatArray, turned: FloatArray) -> FloatArray:
    """Return how far poses lie from others, m; of unit quaternions either sign is the same rotation."""
    chords = [np.linalg.norm(quaternion + sign * turned, axis=-1) for sign in (-1.0, 1.0)]
    angle = 4.0 * np.arcsin(np.minimum(np.minimum(*chords) / 2.0, 1.0))
    return np.hypot(np.linalg.norm(position - at, axis=-1), _LEVER_M * angle)


def _length(increment: FloatArray) -> float:
    return float(np.hypot(np.linalg.norm(increment[:3]), _LEVER_M * np.linalg.norm(increment[3:])))
