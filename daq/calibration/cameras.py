"""Lenses and the stereo pair from views of a ChArUco board by both cameras."""

import numpy as np

from daq.calibration.collected_views import (
    LEAST_TILT_DEG,
    MOST_FOCAL_STD,
    MOST_RMS_PX,
    BoardViews,
    tilt_deg,
)
from daq.calibration_files.outcome import HELD_OUT_SCALE, Figure, Outcome
from daq.calibration_files.results import CamerasResult, Lens
from daq.progress import Progress, silent
from daq.vision.calibration import LensCalibration, calibrate, calibrate_lens
from daq.vision.camera_model import StereoCalibration
from robot_drivers.protocols import Pose

MOST_SCALE = 5e-4
MOST_HELD_OUT_M = 5e-5


def calibrate_cameras(views: BoardViews, progress: Progress = silent) -> Outcome[CamerasResult]:
    """Calibrate each lens alone; ``progress`` is told which.

    Raises
    ------
    CalibrationError
        There are too few views.
    """
    size = views.enough()
    lenses = [
        calibrate_lens([taken[side] for taken in views.taken], views.board.corners, size, name, progress)
        for side, name in enumerate(views.sides)
    ]
    result = CamerasResult(_lens(lenses[0], size), _lens(lenses[1], size))
    figures = [*views.figures(), Figure("largest tilt", tilt_deg(lenses[0]), "°", least=LEAST_TILT_DEG)]
    for name, lens in zip(views.sides, lenses, strict=True):
        focal_std = float(lens.intrinsics_std[0] / lens.intrinsics[0])
        figures += [
            Figure(f"{name} reprojection, rms", lens.rms_px, "px", most=MOST_RMS_PX),
            Figure(f"{name} focal length, relative deviation", focal_std, "", most=MOST_FOCAL_STD),
        ]
    rms = np.array([lens.view_rms_px for lens in lenses])
    return Outcome("cameras", result, tuple(figures), lambda plot: views.draw(plot, rms))


def calibrate_stereo(
    views: BoardViews, T_tissue_board: Pose, progress: Progress = silent, *, first_is_there: bool = True
) -> Outcome[StereoCalibration]:
    """Calibrate the pair; in the first view the board lies at ``T_tissue_board``.

    Parameters
    ----------
    progress : told what is computed, and each step
    first_is_there : False where that view is missing, so that the tissue frame is wherever the board was in the
        first that was taken: what comes out then is to be rejected

    Raises
    ------
    CalibrationError, VisionError
        There are too few views, or they do not determine the lenses.
    """
    size = views.enough()
    pairs = [(left, right) for left, right in views.taken]
    report = calibrate(pairs, views.board, size, 0, T_tissue_board, progress)
    figures = (
        *views.figures(first_is_there=first_is_there),
        Figure("pairs of views left out, as they disagree", float(len(report.rejected)), ""),
        Figure("reprojection, rms", report.calibration.rms_px, "px", most=MOST_RMS_PX),
        Figure("largest rms of a view", float(report.pair_rms_px.max()), "px", most=2 * MOST_RMS_PX),
        Figure(HELD_OUT_SCALE, abs(report.held_out_scale), "", most=MOST_SCALE),
        Figure("held-out distances, rms", report.held_out_rms_m, "m", most=MOST_HELD_OUT_M),
        Figure("baseline", report.calibration.baseline_m, "m"),
    )
    notes = [
        f"left out: {views.names[number]}, {off_px:.3g} px off what the others agree on"
        for number, off_px in report.rejected.items()
    ]
    return Outcome(
        "stereo",
        report.calibration,
        figures,
        lambda plot: views.draw(plot, report.pair_rms_px),
        tuple(notes),
    )


def _lens(found: LensCalibration, size: tuple[int, int]) -> Lens:
    fx, fy, cx, cy, k1, k2, p1, p2 = found.intrinsics.tolist()
    a, b, c, d, e, f, g, h = found.intrinsics_std.tolist()
    return Lens(*size, (fx, fy), (cx, cy), (k1, k2, p1, p2, 0.0), found.rms_px, (a, b, c, d, e, f, g, h))
