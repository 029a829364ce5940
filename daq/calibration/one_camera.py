"""The only camera of a rig, from views of a ChArUco board; in the first the board lies on the phantom."""

import numpy as np

from daq.calibration.collected_views import (
    LEAST_TILT_DEG,
    MOST_FOCAL_STD,
    MOST_RMS_PX,
    BoardViews,
    tilt_deg,
)
from daq.calibration_files.outcome import Figure, Outcome
from daq.frames import compose, inverse, pose
from daq.progress import Progress, silent
from daq.vision.calibration.lens import calibrate_lens, pinhole
from daq.vision.camera_model import PinholeCamera
from robot_drivers.protocols import Pose


def calibrate_camera(
    views: BoardViews, T_tissue_board: Pose, progress: Progress = silent, *, first_is_there: bool = True
) -> Outcome[PinholeCamera]:
    """Calibrate the camera; in the first view the board lies at ``T_tissue_board``.

    Parameters
    ----------
    views : of one side
    first_is_there : False where that view is missing: what comes out then is to be rejected

    Raises
    ------
    CalibrationError
        There are too few views.
    """
    size = views.enough()
    seen = [view for (view,) in views.taken]
    lens = calibrate_lens(seen, views.board.corners, size, "only", progress)
    T_cam_board = pose(lens.translations[0], lens.rotations[0])
    camera = pinhole(lens.intrinsics, size, compose(T_cam_board, inverse(T_tissue_board)))
    focal_std = float(lens.intrinsics_std[0] / lens.intrinsics[0])
    figures = (
        *views.figures(first_is_there=first_is_there),
        Figure("largest tilt", tilt_deg(lens), "°", least=LEAST_TILT_DEG),
        Figure("reprojection, rms", lens.rms_px, "px", most=MOST_RMS_PX),
        Figure("reprojection of the first view, rms", float(lens.view_rms_px[0]), "px", most=MOST_RMS_PX),
        Figure("focal length, relative deviation", focal_std, "", most=MOST_FOCAL_STD),
        Figure("distance from the phantom", float(np.linalg.norm(camera.centre)), "m"),
    )
    return Outcome("camera", camera, figures, lambda plot: views.draw(plot, np.asarray(lens.view_rms_px)))
