"""The camera model against OpenCV, and its file."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from daq.errors import RigError
from daq.vision.camera_model import PinholeCamera, StereoCalibration, pose_looking_at

DISTORTION = (-0.21, 0.12, 8e-4, -6e-4, -0.03)


def camera_at(position: tuple[float, float, float]) -> PinholeCamera:
    return PinholeCamera(
        width=1288,
        height=964,
        focal_length=(2133.3, 2131.0),
        principal_point=(650.2, 478.9),
        distortion=DISTORTION,
        T_cam_tissue=pose_looking_at(position, (0.0, 0.0, 0.005), (1.0, 0.0, 0.0)),
    )


LEFT, RIGHT = camera_at((-0.1, -0.09, 0.36)), camera_at((-0.1, 0.09, 0.36))
POINTS = np.random.default_rng(3).uniform((-0.06, -0.06, -0.02), (0.06, 0.06, 0.02), (200, 3))


def test_projection_agrees_with_opencv() -> None:
    rotation_vector, _ = cv2.Rodrigues(LEFT.R_cam_tissue)
    expected, _ = cv2.projectPoints(
        POINTS,
        rotation_vector,
        np.array(LEFT.T_cam_tissue.position),
        LEFT.intrinsic_matrix,
        np.array(DISTORTION),
    )
    np.testing.assert_allclose(LEFT.project(POINTS), expected[:, 0], atol=1e-8)


def test_the_jacobian_is_the_slope_of_the_projection() -> None:
    step = 1e-7
    _, jacobian = LEFT.project_with_jacobian(POINTS)
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        slope = (LEFT.project(POINTS + shift) - LEFT.project(POINTS - shift)) / (2 * step)
        np.testing.assert_allclose(jacobian[:, :, axis], slope, rtol=1e-5, atol=1e-2)


def test_a_ray_goes_through_the_point_that_it_came_from() -> None:
    directions = LEFT.rays(LEFT.project(POINTS))
    expected = POINTS - LEFT.centre
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(directions, expected, atol=1e-12)


def test_undistortion_agrees_with_opencv() -> None:
    pixels = np.random.default_rng(4).uniform((0, 0), (1287, 963), (100, 2))
    expected = cv2.undistortPointsIter(
        pixels[:, None],
        LEFT.intrinsic_matrix,
        np.array(DISTORTION),
        np.eye(3),
        np.eye(3),
        (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-14),
    )
    np.testing.assert_allclose(LEFT.undistort(pixels), expected[:, 0], atol=1e-9)


def test_a_point_behind_the_camera_has_no_image() -> None:
    assert np.isnan(LEFT.project([-0.2, -0.2, 1.0])).all()


def test_a_camera_looks_at_its_target_with_up_upwards() -> None:
    np.testing.assert_allclose(LEFT.project((0.0, 0.0, 0.005)), LEFT.principal_point)
    assert LEFT.project((0.01, 0.0, 0.005))[1] < LEFT.project((0.0, 0.0, 0.005))[1]


def test_a_calibration_file_reads_back_exactly(tmp_path: Path) -> None:
    calibration = StereoCalibration(LEFT, RIGHT, rms_px=0.071)
    calibration.save(tmp_path / "stereo.toml")
    assert StereoCalibration.load(tmp_path / "stereo.toml") == calibration
    assert calibration.baseline_m == pytest.approx(0.18)


def test_what_is_wrong_in_a_calibration_file_is_told_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "stereo.toml"
    StereoCalibration(LEFT, RIGHT, rms_px=0.071).save(path)
    text = path.read_text()
    path.write_text(text.replace("focal_length = [2133.3, 2131.0]", "focal_length = [2133.3]"))
    with pytest.raises(
        RigError, match=r"stereo\.toml, line \d+: left\.focal_length must have 2 entries, not 1"
    ):
        StereoCalibration.load(path)
    path.write_text(text.replace("width = 1288", "width = 0"))
    with pytest.raises(RigError, match="must be positive"):
        StereoCalibration.load(path)
    with pytest.raises(RigError, match="there is no such file"):
        StereoCalibration.load(tmp_path / "none.toml")
