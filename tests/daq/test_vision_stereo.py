"""Triangulation and matching against exact projections and against OpenCV."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from daq.virtual_rig.rendering.scene import flea2_pair
from daq.vision.beads import Detections
from daq.vision.camera_model import PinholeCamera
from daq.vision.stereo import StereoSettings, epipolar_distance_px, match, triangulate

FloatArray = NDArray[np.float64]

PAIR = flea2_pair()
LEFT, RIGHT = PAIR.left, PAIR.right
POINTS = np.random.default_rng(1).uniform((-0.05, -0.05, -0.01), (0.08, 0.05, 0.02), (60, 3))


def covariances(count: int, sigma_px: float) -> FloatArray:
    return np.broadcast_to(sigma_px**2 * np.eye(2), (count, 2, 2)).copy()


def detections(pixels: FloatArray, radii: float = 4.0) -> Detections:
    count = len(pixels)
    return Detections(pixels, covariances(count, 0.05), np.full(count, radii), np.full(count, 90.0), {})


def opencv_projection(camera: PinholeCamera) -> FloatArray:
    return np.column_stack([camera.R_cam_tissue, camera.T_cam_tissue.position])


def test_exact_pixels_give_the_exact_points() -> None:
    sigma = covariances(len(POINTS), 0.05)
    points = triangulate(PAIR, LEFT.project(POINTS), RIGHT.project(POINTS), sigma, sigma)
    np.testing.assert_allclose(points.positions, POINTS, atol=1e-10)
    assert points.reprojection_px.max() < 1e-6


def test_triangulation_agrees_with_opencv() -> None:
    pixels = [
        camera.project(POINTS) + np.random.default_rng(seed).normal(0.0, 0.02, (len(POINTS), 2))
        for seed, camera in enumerate((LEFT, RIGHT))
    ]
    undistorted = [
        cv2.undistortPointsIter(
            pixel[:, None],
            camera.intrinsic_matrix,
            np.array(camera.distortion),
            np.eye(3),
            np.eye(3),
            (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-14),
        )[:, 0].T
        for pixel, camera in zip(pixels, (LEFT, RIGHT), strict=True)
    ]
    homogeneous = cv2.triangulatePoints(opencv_projection(LEFT), opencv_projection(RIGHT), *undistorted)
    sigma = covariances(len(POINTS), 0.02)
    points = triangulate(PAIR, *pixels, sigma, sigma)
    # the linear method weighs the pixels otherwise, so the two agree within the noise's effect only
    np.testing.assert_allclose(points.positions, (homogeneous[:3] / homogeneous[3]).T, atol=5e-6)


def test_the_covariance_is_the_scatter_of_repeated_measurements() -> None:
    rng = np.random.default_rng(2)
    point = np.array([0.02, -0.01, 0.005])
    left = LEFT.project(point) + rng.normal(0.0, 0.05, (4000, 2))
    right = RIGHT.project(point) + rng.normal(0.0, 0.05, (4000, 2))
    sigma = covariances(4000, 0.05)
    points = triangulate(PAIR, left, right, sigma, sigma)
    np.testing.assert_allclose(np.cov(points.positions.T), points.covariances[0], rtol=0.1, atol=2e-12)
    across, _, along = np.sqrt(np.linalg.eigvalsh(points.covariances[0]))
    # σ r / f = 9 µm for one camera, √2 better for two; r / baseline worse along the line of sight
    assert across == pytest.approx(0.05 * 0.4 / LEFT.focal_length[0] / np.sqrt(2.0), rel=0.1)
    assert along == pytest.approx(0.05 * 0.4 / LEFT.focal_length[0] * np.sqrt(2.0) * 0.4 / 0.175, rel=0.1)


def test_the_epipolar_distance_is_zero_for_partners_and_in_pixels_for_others() -> None:
    left, right = LEFT.project(POINTS), RIGHT.project(POINTS)
    assert np.diag(epipolar_distance_px(PAIR, left, right)).max() < 1e-8
    # the lines run nearly along the rows, so a shift of the right image by 2 px down is 2/√2 px for Sampson
    down = np.diag(epipolar_distance_px(PAIR, left, right + np.array([0.0, 2.0])))
    np.testing.assert_allclose(down, np.sqrt(2.0), rtol=0.05)


def test_beads_find_their_partners_whatever_their_order() -> None:
    grid = np.stack(np.meshgrid([-0.03, -0.01, 0.01, 0.03], [-0.03, -0.01, 0.01, 0.03], [0.005]), axis=-1)
    beads = grid.reshape(-1, 3) + np.random.default_rng(3).normal(0.0, 0.001, (16, 3))
    order = np.random.default_rng(4).permutation(16)
    matches = match(
        PAIR, detections(LEFT.project(beads)), detections(RIGHT.project(beads)[order]), StereoSettings()
    )
    assert len(matches.left) == 16
    np.testing.assert_array_equal(order[matches.right], matches.left)
    np.testing.assert_allclose(matches.points.positions, beads[matches.left], atol=1e-9)


def test_a_bead_without_partner_is_counted() -> None:
    left = detections(LEFT.project(POINTS[:5]))
    right = detections(RIGHT.project(POINTS[1:5]))
    matches = match(PAIR, left, right, StereoSettings())
    assert 0 not in matches.left
    assert matches.rejected["no partner"] == 1


def test_two_beads_on_one_epipolar_line_are_left_out_as_ambiguous() -> None:
    point = np.array([0.0, 0.0, 0.005])
    along_the_line = RIGHT.project(point + 0.01 * (point - LEFT.centre))
    right = detections(np.stack([RIGHT.project(point), along_the_line]))
    matches = match(PAIR, detections(LEFT.project(point)[None]), right, StereoSettings())
    assert len(matches.left) == 0
    assert matches.rejected["ambiguous pair"] == 1


@pytest.mark.parametrize(
    ("point", "radius", "settings", "reason"),
    [
        ((0.0, 0.0, 0.1), 4.0, StereoSettings(), "outside the box"),
        ((0.0, 0.0, 0.005), 8.0, StereoSettings(), "no partner"),
        ((0.0, 0.0, 0.005), 4.0, replace(StereoSettings(), reprojection_px=0.1), "reprojection"),
    ],
)
def test_a_pair_that_no_bead_can_make_is_refused(
    point: tuple[float, float, float], radius: float, settings: StereoSettings, reason: str
) -> None:
    left = detections(LEFT.project(point)[None])
    right = detections(RIGHT.project(point)[None] + np.array([0.0, 0.5]), radius)
    matches = match(PAIR, left, right, settings)
    assert len(matches.left) == 0
    assert matches.rejected[reason] >= 1


def test_images_without_beads_give_no_points() -> None:
    nothing = detections(np.empty((0, 2)))
    assert len(match(PAIR, nothing, nothing, StereoSettings()).left) == 0
    assert len(match(PAIR, detections(LEFT.project(POINTS)), nothing, StereoSettings()).left) == 0
