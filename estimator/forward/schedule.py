"""Which poses of the gripper have to be solved for an experiment.

The reported pose carries noise of a known size, and a retraction returns to poses where it has been. Rows whose
poses agree within that noise share one state, at their mean pose: its error is smaller than that of any single row.
That holds where states stand clear of each other. Where the noise is as large as the way between two poses, rows that
happen to lie near each other would be taken for one, and their mean for better than it is: then poses have to agree
the better, in the end every row by itself. So it is where less noise is there than is stated, too.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Two readings of one pose differ by less than this many standard deviations of a coordinate, 999 times in 1000.
_AGREEMENT = 6.0
# States are clear of each other from this many times the distance on within which rows are one.
_CLEAR = 1.5
# So often that distance is halved at the most: what is left then agrees but for rounding.
_HALVINGS = 20
# So many rows are parted at the most, for each may be a state that has to be solved: a motion that was recorded while
# it went on, in thousands of rows, is followed in steps of the noise.
_MOST_PARTED = 200
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
    state_of_row = _states(position, quaternion, _AGREEMENT * position_std)
    poses = []
    for state in range(state_of_row.max(initial=-1) + 1):
        rows = np.flatnonzero(state_of_row == state)
        poses.append(GripperPose(position[rows].mean(axis=0), rotation[rows].mean()))
    return PoseSchedule(tuple(poses), state_of_row, np.bincount(state_of_row, minlength=len(poses)))


def _states(position: FloatArray, quaternion: FloatArray, noise: float, halved: int = 0) -> IntArray:
    """Return the state (n,) of each row, in the order of their first rows.

    Rows are one within the distance ``noise``. Those of states that are not clear of each other are parted anew by half
    of it, where they are one only if they scatter by as little: if less noise is there than is stated. Where that would
    be too many rows they stay as they are.
    """
    state_of_row, first = _within(position, quaternion, noise)
    doubtful = _not_clear(position[first], quaternion[first], _CLEAR * noise)
    if halved:
        wide = np.flatnonzero(_AGREEMENT * _scatter(position, state_of_row) > noise)
        doubtful += [np.array([state]) for state in wide if not any(state in group for group in doubtful)]
    rows_of_groups = [np.flatnonzero(np.isin(state_of_row, alike)) for alike in doubtful]
    few = sum(map(len, rows_of_groups)) <= _MOST_PARTED
    for rows in rows_of_groups if few and halved < _HALVINGS else ():
        parted = _states(position[rows], quaternion[rows], noise / 2, halved + 1)
        state_of_row[rows] = len(position) * (1 + rows[0]) + parted
    _, begin, number = np.unique(state_of_row, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(begin))[number]


def _scatter(position: FloatArray, state_of_row: IntArray) -> FloatArray:
    """Return the standard deviation (s,) of a coordinate about the mean of its state, m; 0 of a single row."""
    rows = np.bincount(state_of_row)
    mean = np.stack([np.bincount(state_of_row, one) for one in position.T], axis=1) / rows[:, None]
    squares = np.bincount(state_of_row, np.sum((position - mean[state_of_row]) ** 2, axis=1))
    return np.asarray(np.sqrt(squares / (3.0 * np.maximum(rows - 1, 1))))


def _within(position: FloatArray, quaternion: FloatArray, tolerance: float) -> tuple[IntArray, list[int]]:
    """Return the state (n,) of each row, the nearest within the tolerance or a new one, and the first row of each."""
    first: list[int] = []
    state_of_row = np.empty(len(position), dtype=np.int64)
    for row in range(len(position)):
        if first:
            distances = _distance(position[first], quaternion[first], position[row], quaternion[row])
            nearest = int(np.argmin(distances))
            if distances[nearest] <= tolerance:
                state_of_row[row] = nearest
                continue
        state_of_row[row] = len(first)
        first.append(row)
    return state_of_row, first


def _not_clear(position: FloatArray, quaternion: FloatArray, distance: float) -> list[IntArray]:
    """Return the groups, of two and more, of poses that are joined by steps shorter than the distance."""
    near = [
        np.flatnonzero(_distance(position[:n], quaternion[:n], position[n], quaternion[n]) < distance)
        for n in range(len(position))
    ]
    later, earlier = (
        np.repeat(np.arange(len(near)), [len(each) for each in near]),
        np.concatenate([*near, []]),
    )
    joined = coo_array((np.ones(len(later)), (later, earlier.astype(np.int64))), shape=(len(near),) * 2)
    count, group = connected_components(joined, directed=False)
    return [np.flatnonzero(group == n) for n in range(count) if np.count_nonzero(group == n) > 1]


def spread_states(schedule: PoseSchedule, count: int) -> list[int]:
    """Return up to ``count`` states spread evenly along the motion, the farthest among them, in its order."""
    way = travel(schedule)
    wanted = np.linspace(0.0, way.max(), count + 1)[1:]
    return sorted({int(np.argmin(np.abs(way - w))) for w in wanted})


def travel(schedule: PoseSchedule) -> FloatArray:
    """Return how far each state lies from the first, m; rotations count by their lever."""
    origin = schedule.poses[0]
    return np.array([_length(origin.increment_to(pose)) for pose in schedule.poses])


def _distance(position: FloatArray, quaternion: FloatArray, at: FloatArray, turned: FloatArray) -> FloatArray:
    """Return how far poses lie from others, m; of unit quaternions either sign is the same rotation."""
    chords = [np.linalg.norm(quaternion + sign * turned, axis=-1) for sign in (-1.0, 1.0)]
    angle = 4.0 * np.arcsin(np.minimum(np.minimum(*chords) / 2.0, 1.0))
    return np.hypot(np.linalg.norm(position - at, axis=-1), _LEVER_M * angle)


def _length(increment: FloatArray) -> float:
    return float(np.hypot(np.linalg.norm(increment[:3]), _LEVER_M * np.linalg.norm(increment[3:])))
