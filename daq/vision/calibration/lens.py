"""One camera calibrated alone by Zhang's method, from images of a ChArUco board.

Source: Zhang, "A flexible new technique for camera calibration", IEEE TPAMI 22(11), 2000.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq import frames
from daq.progress import Progress, silent
from daq.vision.camera_model import PinholeCamera
from daq.vision.charuco import BoardView
from robot_drivers.protocols import Pose

FloatArray = NDArray[np.float64]

INTRINSICS = 8  # fx fy cx cy k1 k2 p1 p2
_MOST_STEPS = 30


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

    def camera(self, image_size: tuple[int, int]) -> PinholeCamera:
        """Return the camera, in its own frame."""
        return pinhole(self.intrinsics, image_size, frames.IDENTITY)

    def only(self, views: NDArray[np.intp]) -> Self:
        """Return the same lens with these views (k,) alone."""
        return replace(
            self,
            rotations=self.rotations[views],
            translations=self.translations[views],
            view_rms_px=self.view_rms_px[views],
        )


def pinhole(intrinsics: FloatArray, image_size: tuple[int, int], T_cam_tissue: Pose) -> PinholeCamera:
    """Return the camera of intrinsics (8,), fx fy cx cy k1 k2 p1 p2."""
    fx, fy, cx, cy, k1, k2, p1, p2 = intrinsics.tolist()
    return PinholeCamera(*image_size, (fx, fy), (cx, cy), (k1, k2, p1, p2, 0.0), T_cam_tissue)


def calibrate_lens(
    views: Sequence[BoardView],
    corners: FloatArray,
    image_size: tuple[int, int],
    name: str = "one",
    progress: Progress = silent,
) -> LensCalibration:
    """Calibrate one camera by Zhang's method, in a bounded number of steps.

    Parameters
    ----------
    corners : (n, 3) of the board, m
    image_size : width, height, px
    name : of the camera, told as ``progress``
    """
    progress(f"calibrating the {name} camera alone in {len(views)} views", 0, 1)
    rms, matrix, distortion, rotations, translations, std, _, view_rms = cv2.calibrateCameraExtended(
        [corners[view.numbers].astype(np.float32) for view in views],
        [view.pixels.astype(np.float32) for view in views],
        image_size,
        np.eye(3),
        np.zeros(5),
        flags=cv2.CALIB_FIX_K3,
        criteria=(cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, _MOST_STEPS, float(np.finfo(float).eps)),
    )
    intrinsics = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion.ravel()[:4]]
    rotation_vectors, vectors = (
        np.array(poses, dtype=np.float64)[..., 0] for poses in (rotations, translations)
    )
    return LensCalibration(
        np.array(intrinsics, dtype=np.float64),
        np.asarray(std, dtype=np.float64).ravel()[:INTRINSICS],
        Rotation.from_rotvec(rotation_vectors),
        vectors,
        float(rms),
        np.asarray(view_rms, dtype=np.float64).ravel(),
    )
