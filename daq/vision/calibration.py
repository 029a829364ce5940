"""Calibration of the stereo pair from images of a ChArUco board.

Each camera is calibrated alone first (Zhang's method, by OpenCV). Then intrinsics, distortion, the pose of
one camera to the other and all poses of the board are refined together on the reprojection errors in both
images; k3 stays zero, for a lens of moderate field cannot tell it from k2. Every fifth pair of views is held
out: the distances between its triangulated corners against those on the board tell how true lengths come out.
What no view can tell is a wrong size of the squares: that scales the baseline and all positions, so measure
the print.

Source: Zhang, "A flexible new technique for camera calibration", IEEE TPAMI 22(11), 2000.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from daq import frames
from daq.vision.camera_model import PinholeCamera, StereoCalibration
from daq.vision.charuco import BoardView, CharucoBoard
from daq.vision.errors import VisionError
from daq.vision.stereo import triangulate
from robot_drivers.protocols import Pose

FloatArray = NDArray[np.float64]
BoardPair = tuple[BoardView, BoardView]

_FEWEST_PAIRS = 10
_HOLD_OUT_EVERY = 5
_INTRINSICS = 8  # fx fy cx cy k1 k2 p1 p2
_POSE = 6  # rotation vector, translation


@dataclass(frozen=True, slots=True)
class CalibrationReport:
    """A calibration and what speaks for it.

    Attributes
    ----------
    calibration : in the tissue frame
    pair_rms_px : (n,) reprojection error of every pair of views that was used
    intrinsics_std : (2, 8) standard deviations of fx fy cx cy, px, and k1 k2 p1 p2, left and right camera
    held_out_scale : measured over true distance on the board, less one, in the pairs of views held out
    held_out_rms_m : rms error of those distances
    """

    calibration: StereoCalibration
    pair_rms_px: FloatArray
    intrinsics_std: FloatArray
    held_out_scale: float
    held_out_rms_m: float


def calibrate(
    pairs: Sequence[BoardPair],
    board: CharucoBoard,
    image_size: tuple[int, int],
    reference: int,
    T_tissue_board: Pose,
) -> CalibrationReport:
    """Calibrate two cameras.

    Parameters
    ----------
    pairs : views of the board in the left and the right image; tilt it up to 45° and cover the whole field
    board : as measured on the print
    image_size : width, height, px
    reference : number of the pair of views in which the board lay at ``T_tissue_board``

    Raises
    ------
    VisionError
        There are fewer than ten pairs of views, ``reference`` is none of them, or the views do not determine
        the lens.
    """
    if len(pairs) < _FEWEST_PAIRS or not 0 <= reference < len(pairs):
        raise VisionError(
            f"calibration: {len(pairs)} pairs of views with reference {reference}; take {_FEWEST_PAIRS} or more, "
            "and name one of them, counted from 0"
        )
    held_out = [k for k in range(len(pairs)) if k % _HOLD_OUT_EVERY == _HOLD_OUT_EVERY - 1 and k != reference]
    used = [k for k in range(len(pairs)) if k not in held_out]
    bundle = _Bundle([pairs[k] for k in used], board.corners, image_size)
    solution = least_squares(bundle.residuals, bundle.start(), x_scale="jac", method="lm")
    left, right = bundle.cameras(solution.x)
    T_left_board = bundle.board_pose(solution.x, used.index(reference))
    T_left_tissue = frames.compose(T_left_board, frames.inverse(T_tissue_board))
    calibration = StereoCalibration(
        left=replace(left, T_cam_tissue=T_left_tissue),
        right=replace(right, T_cam_tissue=frames.compose(right.T_cam_tissue, T_left_tissue)),
        rms_px=float(np.sqrt(2.0 * np.mean(solution.fun**2))),
    )
    measured, true = _distances(calibration, [pairs[k] for k in held_out], board.corners)
    return CalibrationReport(
        calibration=calibration,
        pair_rms_px=bundle.pair_rms(solution.fun),
        intrinsics_std=_standard_deviations(solution)[: 2 * _INTRINSICS].reshape(2, _INTRINSICS),
        held_out_scale=float(measured @ true / (true @ true) - 1.0),
        held_out_rms_m=float(np.sqrt(np.mean((measured - true) ** 2))),
    )


@dataclass(frozen=True, slots=True)
class LensCalibration:
    """One camera calibrated alone.

    Attributes
    ----------
    intrinsics, intrinsics_std : (8,) fx fy cx cy, px, k1 k2 p1 p2
    rotations, translations : pose of the board in the camera frame in each of n views
    rms_px : reprojection error
    view_rms_px : (n,) of each view
    """

    intrinsics: FloatArray
    intrinsics_std: FloatArray
    rotations: Rotation
    translations: FloatArray
    rms_px: float
    view_rms_px: FloatArray


def calibrate_lens(
    views: Sequence[BoardView], corners: FloatArray, image_size: tuple[int, int]
) -> LensCalibration:
    """Calibrate one camera by Zhang's method; ``corners`` (n, 3) of the board, ``image_size`` width and height."""
    rms, matrix, distortion, rotations, translations, std, _, view_rms = cv2.calibrateCameraExtended(
        [corners[view.numbers].astype(np.float32) for view in views],
        [view.pixels.astype(np.float32) for view in views],
        image_size,
        np.eye(3),
        np.zeros(5),
        flags=cv2.CALIB_FIX_K3,
    )
    intrinsics = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion.ravel()[:4]]
    rotation_vectors, vectors = (
        np.array(poses, dtype=np.float64)[..., 0] for poses in (rotations, translations)
    )
    return LensCalibration(
        np.array(intrinsics, dtype=np.float64),
        np.asarray(std, dtype=np.float64).ravel()[:_INTRINSICS],
        Rotation.from_rotvec(rotation_vectors),
        vectors,
        float(rms),
        np.asarray(view_rms, dtype=np.float64).ravel(),
    )


class _Bundle:
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

    def start(self) -> FloatArray:
        """Calibrate each camera alone and take the mean pose between them."""
        alone = [calibrate_lens(side, self._corners, self._image_size) for side in self._sides]
        intrinsics = [lens.intrinsics for lens in alone]
        rotations, translations = ([lens.rotations for lens in alone], [lens.translations for lens in alone])
        between = rotations[1] * rotations[0].inv()
        rotation = between.mean()
        translation = np.median(translations[1] - between.apply(translations[0]), axis=0)
        boards = np.hstack([rotations[0].as_rotvec(), translations[0]])
        return np.concatenate([*intrinsics, rotation.as_rotvec(), translation, boards.ravel()])

    def residuals(self, parameters: FloatArray) -> FloatArray:
        """Return reprojected less measured pixels, x and y of every corner, left views then right ones."""
        left, right = self.cameras(parameters)
        boards = parameters[2 * _INTRINSICS + _POSE :].reshape(-1, _POSE)
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

    def cameras(self, parameters: FloatArray) -> tuple[PinholeCamera, PinholeCamera]:
        """Return the left and the right camera in the frame of the left one."""
        left, right = parameters[: 2 * _INTRINSICS].reshape(2, _INTRINSICS)
        T_right_left = _pose(parameters[2 * _INTRINSICS :][:_POSE])
        return self._camera(left, frames.IDENTITY), self._camera(right, T_right_left)

    def board_pose(self, parameters: FloatArray, pair: int) -> Pose:
        """Return the pose of the board in the left camera's frame."""
        return _pose(parameters[2 * _INTRINSICS + _POSE :].reshape(-1, _POSE)[pair])

    def pair_rms(self, residuals: FloatArray) -> FloatArray:
        """Return the rms distance (n,), px, in every pair of views."""
        squares = np.sum(residuals.reshape(-1, 2) ** 2, axis=1)
        pair_of = np.concatenate(self._pair_of)
        return np.sqrt(np.bincount(pair_of, squares) / np.bincount(pair_of))

    def _camera(self, intrinsics: FloatArray, T_cam_left: Pose) -> PinholeCamera:
        fx, fy, cx, cy, k1, k2, p1, p2 = intrinsics.tolist()
        return PinholeCamera(*self._image_size, (fx, fy), (cx, cy), (k1, k2, p1, p2, 0.0), T_cam_left)


def _pose(parameters: FloatArray) -> Pose:
    return frames.pose(parameters[3:], Rotation.from_rotvec(parameters[:3]))


def _standard_deviations(solution: OptimizeResult) -> FloatArray:
    """Return the standard deviation of every parameter, from the scatter of the residuals."""
    jacobian = np.asarray(solution.jac, dtype=np.float64)
    variance = np.sum(solution.fun**2) / (len(solution.fun) - len(solution.x))
    try:
        covariance = variance * np.linalg.inv(jacobian.T @ jacobian)
    except np.linalg.LinAlgError as error:
        raise VisionError("calibration: the views do not determine the lens; tilt the board more") from error
    return np.sqrt(np.diag(covariance))


def _distances(
    calibration: StereoCalibration, pairs: Sequence[BoardPair], corners: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the measured and the true distances between all corners that both images of a pair show, m."""
    measured, true = [], []
    for left, right in pairs:
        numbers, in_left, in_right = np.intersect1d(left.numbers, right.numbers, return_indices=True)
        noise = np.broadcast_to(np.eye(2), (len(numbers), 2, 2))
        points = triangulate(calibration, left.pixels[in_left], right.pixels[in_right], noise, noise)
        measured.append(pdist(points.positions))
        true.append(pdist(corners[numbers]))
    return np.concatenate(measured), np.concatenate(true)
