"""Which pairs of views agree about how the two cameras stand to one another.

Every pair tells the pose between the cameras by itself, roughly: the board's pose in each, from each camera calibrated
alone. Images of two moments tell another pose. The pose on which most pairs agree is found among those that single
pairs tell; how far the corners of a pair are from where it puts them is what the pair disagrees by.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq import frames
from daq.vision.calibration.lens import LensCalibration
from daq.vision.charuco import BoardView
from robot_drivers.protocols import Pose

FloatArray = NDArray[np.float64]

_MOST_CANDIDATES = 60
_ROUNDS = 4
_MOST_PX = 3.0  # what a pose from one view each may be off by, where each camera was calibrated alone
_MOST_TIMES_TYPICAL = 5.0
_MOST_PX_AT_ALL = 15.0  # so far may the pose be off that one pair tells
_SHIFTS = (1, -1, 2, -2)
_FEWEST_SHIFTED = 4
_MOST_AGREE = 0.8


@dataclass(frozen=True, slots=True)
class Agreement:
    """What the pairs agree on.

    Attributes
    ----------
    T_right_left : pose of the left camera in the frame of the right one
    off_px : (n,) rms distance of each pair's corners in the right image from where that pose puts them
    agrees : (n,) whether a pair agrees
    """

    T_right_left: Pose
    off_px: FloatArray
    agrees: NDArray[np.bool_]


def agreement(
    right_views: Sequence[BoardView],
    lenses: tuple[LensCalibration, LensCalibration],
    corners: FloatArray,
    image_size: tuple[int, int],
) -> Agreement:
    """Find what most pairs of views agree on.

    Parameters
    ----------
    right_views : of the right camera (n,)
    lenses : left and right camera, each calibrated alone in its n views of the pairs
    corners : (m, 3) of the board, m
    image_size : width, height, px
    """
    left, right = lenses
    camera = right.camera(image_size)
    pair_of = np.repeat(np.arange(len(right_views)), [len(view.numbers) for view in right_views])
    points = corners[np.concatenate([view.numbers for view in right_views])]
    in_left = left.rotations[pair_of].apply(points) + left.translations[pair_of]
    pixels = np.concatenate([view.pixels for view in right_views])

    def off_px(rotation: Rotation, translation: FloatArray) -> FloatArray:
        squares = np.sum((camera.project(rotation.apply(in_left) + translation) - pixels) ** 2, axis=1)
        squares = np.nan_to_num(squares, nan=np.inf)  # behind the camera
        return np.sqrt(np.bincount(pair_of, squares) / np.bincount(pair_of))

    turns = right.rotations * left.rotations.inv()
    ways = right.translations - turns.apply(left.translations)
    candidates = np.unique(np.linspace(0, len(right_views) - 1, _MOST_CANDIDATES).astype(int))
    off = max((off_px(turns[k], ways[k]) for k in candidates), key=lambda one: np.sum(one <= _MOST_PX_AT_ALL))
    agrees = off <= _MOST_PX_AT_ALL
    for _ in range(_ROUNDS):
        turn, way = turns[agrees].mean(), np.median(ways[agrees], axis=0)
        off = off_px(turn, way)
        near = off[off <= _MOST_PX_AT_ALL]
        typical = float(np.median(near)) if len(near) else np.inf
        agrees = off <= np.clip(_MOST_TIMES_TYPICAL * typical, _MOST_PX, _MOST_PX_AT_ALL)
        if not agrees.any():
            break
    return Agreement(frames.pose(way, turn), off, agrees)


def shift_that_agrees(
    right_views: Sequence[BoardView],
    lenses: tuple[LensCalibration, LensCalibration],
    corners: FloatArray,
    image_size: tuple[int, int],
) -> int | None:
    """Return by how many places the right views have to be counted on so that most pairs agree; None where none does.

    Parameters are those of :func:`agreement`.
    """
    for shift in _SHIFTS:
        left = np.arange(max(0, -shift), len(right_views) - max(0, shift))
        if len(left) < _FEWEST_SHIFTED:
            continue
        right = left + shift
        moved = (lenses[0].only(left), lenses[1].only(right))
        found = agreement([right_views[k] for k in right.tolist()], moved, corners, image_size)
        if np.mean(found.agrees) > _MOST_AGREE:
            return shift
    return None
