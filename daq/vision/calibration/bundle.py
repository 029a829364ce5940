"""Reprojection errors of all views of a board by two cameras, as a function of everything that is not known."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq import frames
from daq.vision.calibration.lens import INTRINSICS, LensCalibration, pinhole
from daq.vision.camera_model import PinholeCamera
from daq.vision.charuco import BoardView
from robot_drivers.protocols import Pose

FloatArray = NDArray[np.float64]
BoardPair = tuple[BoardView, BoardView]

POSE = 6  # rotation vector, translation
_SHARED = 2 * INTRINSICS + POSE
_DIFFERENCE = float(np.sqrt(np.finfo(np.float64).eps))  # of a parameter, relative


class Bundle:
    """Reprojection of all views as a function of one vector of parameters.

    The vector holds the intrinsics of both cameras, the pose of the left camera in the right one's frame, and
    the board's pose in the left camera's frame for every pair of views.
    """

    def __init__(self, pairs: Sequence[BoardPair], corners: FloatArray, image_size: tuple[int, int]) -> None:
        self._corners = corners
        self._image_size = image_size
        self._sides = [[pair[side] for pair in pairs] for side in (0, 1)]
        self._pair_of = [
            np.repeat(np.arange(len(pairs)), [len(view.numbers) for view in side]) for side in self._sides
        ]
        self._points = [corners[np.concatenate([view.numbers for view in side])] for side in self._sides]
        self._pixels = [np.concatenate([view.pixels for view in side]) for side in self._sides]

    def start(self, lenses: Sequence[LensCalibration], T_right_left: Pose) -> FloatArray:
        """Return the parameters from each camera calibrated alone, in the same views, and the pose between them."""
        left, right = lenses
        between = frames.rotation(T_right_left.quaternion_wxyz).as_rotvec()
        boards = np.hstack([left.rotations.as_rotvec(), left.translations])
        return np.concatenate(
            [left.intrinsics, right.intrinsics, between, T_right_left.position, boards.ravel()]
        )

    def residuals(self, parameters: FloatArray) -> FloatArray:
        """Return reprojected less measured pixels, x and y of every corner, left views then right ones."""
        left, right = self.cameras(parameters)
        boards = parameters[2 * INTRINSICS + POSE :].reshape(-1, POSE)
        rotations = Rotation.from_rotvec(boards[:, :3])
        in_left = [
            rotations[pair_of].apply(points) + boards[pair_of, 3:]
            for pair_of, points in zip(self._pair_of, self._points, strict=True)
        ]
        errors = [
            camera.project(points) - pixels
            for camera, points, pixels in zip((left, right), in_left, self._pixels, strict=True)
        ]
        return np.concatenate(errors).ravel()

    def jacobian(self, parameters: FloatArray) -> FloatArray:
        """Return the derivatives of the residuals, by differences; all boards are moved at once."""
        at_rest = self.residuals(parameters)
        steps = _DIFFERENCE * np.where(parameters == 0.0, 1.0, np.abs(parameters))
        found = np.zeros((len(at_rest), len(parameters)))
        for number in range(_SHARED):
            moved = parameters.copy()
            moved[number] += steps[number]
            found[:, number] = (self.residuals(moved) - at_rest) / steps[number]
        rows = np.arange(len(at_rest))
        pair_of = np.repeat(np.concatenate(self._pair_of), 2)
        for coordinate in range(POSE):
            columns = np.arange(_SHARED + coordinate, len(parameters), POSE)
            moved = parameters.copy()
            moved[columns] += steps[columns]
            column = columns[pair_of]
            found[rows, column] = (self.residuals(moved) - at_rest) / steps[column]
        return found

    def cameras(self, parameters: FloatArray) -> tuple[PinholeCamera, PinholeCamera]:
        """Return the left and the right camera in the frame of the left one."""
        left, right = parameters[: 2 * INTRINSICS].reshape(2, INTRINSICS)
        T_right_left = _pose(parameters[2 * INTRINSICS :][:POSE])
        return (
            pinhole(left, self._image_size, frames.IDENTITY),
            pinhole(right, self._image_size, T_right_left),
        )

    def board_pose(self, parameters: FloatArray, pair: int) -> Pose:
        """Return the pose of the board in the left camera's frame."""
        return _pose(parameters[2 * INTRINSICS + POSE :].reshape(-1, POSE)[pair])

    def pair_rms(self, residuals: FloatArray) -> FloatArray:
        """Return the rms distance (n,), px, in every pair of views."""
        squares = np.sum(residuals.reshape(-1, 2) ** 2, axis=1)
        pair_of = np.concatenate(self._pair_of)
        return np.sqrt(np.bincount(pair_of, squares) / np.bincount(pair_of))


def _pose(parameters: FloatArray) -> Pose:
    return frames.pose(parameters[3:], Rotation.from_rotvec(parameters[:3]))
