"""The gripper's motion as a history, without what the noise of its reported position would add to it."""

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Motion

FloatArray = NDArray[np.float64]

# Two readings of one pose differ by less than this many standard deviations of a coordinate, 999 times in 1000.
_AGREEMENT = 6.0
# A turn by less than this is none, rad: 0.01 mm at 10 mm.
_NO_TURN = 1e-3


def settled(motion: Motion) -> FloatArray:
    """Return the position (n, 3), m; as long as the gripper stands, the mean over all that time."""
    position = motion.position.copy()
    for rows in _standing(motion):
        position[rows] = motion.position[rows].mean(axis=0)
    return position


def _standing(motion: Motion) -> list[slice]:
    """Return the runs of consecutive rows in which the gripper does not leave the pose of the first of them."""
    position, rotation = motion.position, motion.rotation
    noise = _AGREEMENT * motion.experiment.sensor.position_std
    runs, first = [], 0
    for row in range(1, len(position)):
        turn = float((rotation[row] * rotation[first].inv()).magnitude())
        if np.linalg.norm(position[row] - position[first]) > noise or turn > _NO_TURN:
            runs.append(slice(first, row))
            first = row
    return [*runs, slice(first, len(position))]
