"""Calibration of the stereo pair from images of a ChArUco board.

Each camera is calibrated alone first (Zhang's method, by OpenCV). Pairs of views whose images are not of one moment
are found and left out, for they tell another pose between the cameras than most. Then intrinsics, distortion,
the pose of one camera to the other and all poses of the board are refined together on the reprojection errors in both
images; k3 stays zero, for a lens of moderate field cannot tell it from k2. Every fifth pair of views is held
out: the distances between its triangulated corners against those on the board tell how true lengths come out.
What no view can tell is a wrong size of the squares: that scales the baseline and all positions, so measure
the print.

Source: Zhang, "A flexible new technique for camera calibration", IEEE TPAMI 22(11), 2000.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.spatial.distance import pdist

from daq import frames
from daq.progress import Progress, silent
from daq.vision.calibration.agreement import agreement, shift_that_agrees
from daq.vision.calibration.bundle import BoardPair, Bundle
from daq.vision.calibration.lens import INTRINSICS, LensCalibration, calibrate_lens
from daq.vision.camera_model import StereoCalibration
from daq.vision.charuco import CharucoBoard
from daq.vision.errors import VisionError
from daq.vision.stereo import triangulate
from robot_drivers.protocols import Pose

FloatArray = NDArray[np.float64]

_FEWEST_PAIRS = 10
_HOLD_OUT_EVERY = 5
_MOST_STEPS = 100
_MOST_ROUNDS = 3  # of leaving out views that do not fit the rest, and refining again
_MOST_PX = 0.5  # of a view, where the typical one is much better
_MOST_TIMES_TYPICAL = 5.0


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
    rejected : by the number of a pair of views, how far, px, it is from what the others agree on
    """

    calibration: StereoCalibration
    pair_rms_px: FloatArray
    intrinsics_std: FloatArray
    held_out_scale: float
    held_out_rms_m: float
    rejected: Mapping[int, float]


def calibrate(
    pairs: Sequence[BoardPair],
    board: CharucoBoard,
    image_size: tuple[int, int],
    reference: int,
    T_tissue_board: Pose,
    progress: Progress = silent,
) -> CalibrationReport:
    """Calibrate two cameras.

    Parameters
    ----------
    pairs : views of the board in the left and the right image; tilt it up to 45° and cover the whole field
    board : as measured on the print
    image_size : width, height, px
    reference : number of the pair of views in which the board lay at ``T_tissue_board``
    progress : told what is computed, and each step of the refinement

    Raises
    ------
    VisionError
        There are fewer than ten pairs of views that agree about how the cameras stand to one another, or no more than
        half of all do, ``reference`` is none of them, the views do not determine the lens, or the refinement does not
        converge.
    """
    if len(pairs) < _FEWEST_PAIRS or not 0 <= reference < len(pairs):
        raise VisionError(
            f"calibration: {len(pairs)} pairs of views with reference {reference}; take {_FEWEST_PAIRS} or more, "
            "and name one of them, counted from 0"
        )
    lenses = _alone(pairs, board, image_size, progress)
    right_views = [right for _, right in pairs]
    found = agreement(right_views, lenses, board.corners, image_size)
    off_px = found.off_px
    agreeing = np.flatnonzero(found.agrees)
    if len(agreeing) < max(_FEWEST_PAIRS, len(pairs) // 2 + 1):
        shift = shift_that_agrees(right_views, lenses, board.corners, image_size)
        raise VisionError(_disagreement(len(agreeing), len(pairs), shift))
    for _ in range(_MOST_ROUNDS):
        if reference not in agreeing:
            raise VisionError(
                f"calibration: the view of the board at its known place is off by {off_px[reference]:.3g} px from what "
                "the others agree on: its two images are not of one moment; take it again"
            )
        held_out = [k for k in agreeing[_HOLD_OUT_EVERY - 1 :: _HOLD_OUT_EVERY].tolist() if k != reference]
        used = [k for k in agreeing.tolist() if k not in held_out]
        bundle = Bundle([pairs[k] for k in used], board.corners, image_size)
        solution = _refined(
            bundle, [lens.only(np.array(used)) for lens in lenses], found.T_right_left, progress
        )
        rms_px = bundle.pair_rms(solution.fun)
        apart = rms_px > max(_MOST_PX, _MOST_TIMES_TYPICAL * float(np.median(rms_px)))
        if not apart.any() or len(agreeing) - apart.sum() < _FEWEST_PAIRS:
            break
        off_px[np.array(used)[apart]] = rms_px[apart]
        agreeing = np.setdiff1d(agreeing, np.array(used)[apart])
    left, right = bundle.cameras(solution.x)
    T_left_board = bundle.board_pose(solution.x, used.index(reference))
    T_left_tissue = frames.compose(T_left_board, frames.inverse(T_tissue_board))
    calibration = StereoCalibration(
        left=replace(left, T_cam_tissue=T_left_tissue),
        right=replace(right, T_cam_tissue=frames.compose(right.T_cam_tissue, T_left_tissue)),
        rms_px=float(np.sqrt(2.0 * np.mean(solution.fun**2))),
    )
    measured, true = _distances(calibration, [pairs[k] for k in held_out], board.corners)
    rejected = np.setdiff1d(np.arange(len(pairs)), agreeing)
    return CalibrationReport(
        calibration=calibration,
        pair_rms_px=rms_px,
        intrinsics_std=_standard_deviations(solution)[: 2 * INTRINSICS].reshape(2, INTRINSICS),
        held_out_scale=float(measured @ true / (true @ true) - 1.0),
        held_out_rms_m=float(np.sqrt(np.mean((measured - true) ** 2))),
        rejected={int(k): float(off_px[k]) for k in rejected},
    )


def _alone(
    pairs: Sequence[BoardPair], board: CharucoBoard, image_size: tuple[int, int], progress: Progress
) -> tuple[LensCalibration, LensCalibration]:
    left, right = (
        calibrate_lens([pair[side] for pair in pairs], board.corners, image_size, name, progress)
        for side, name in enumerate(("left", "right"))
    )
    return left, right


def _disagreement(agreeing: int, count: int, shift: int | None) -> str:
    hint = "" if shift is None else f" (most agree where the right views are counted on by {shift})"
    return (
        f"calibration: only {agreeing} of {count} pairs of views agree about how the cameras stand to one another"
        f"{hint}: the images of a pair are not of one moment, or a camera was moved; pair them anew, or take the "
        "views again"
    )


def _refined(
    bundle: Bundle, lenses: Sequence[LensCalibration], T_right_left: Pose, progress: Progress
) -> OptimizeResult:
    """Refine everything together in a bounded number of steps; raises VisionError where it does not converge."""
    steps = 0

    def jacobian(parameters: FloatArray) -> FloatArray:
        nonlocal steps
        progress("refining both cameras and all views together", min(steps, _MOST_STEPS), _MOST_STEPS)
        steps += 1
        return bundle.jacobian(parameters)

    solution = least_squares(
        bundle.residuals,
        bundle.start(lenses, T_right_left),
        jacobian,
        x_scale="jac",
        method="lm",
        max_nfev=_MOST_STEPS,
    )
    if not solution.success:
        raise VisionError(
            f"calibration: has not converged in {_MOST_STEPS} steps; the pairs of views do not fit together, take them "
            "again"
        )
    return solution


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
