"""Calibration from rendered images of a ChArUco board against the cameras that rendered them."""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq import frames
from daq.virtual_rig.rendering.scene import flea2_pair
from daq.vision.calibration import BoardPair, CalibrationReport, calibrate
from daq.vision.camera_model import PinholeCamera
from daq.vision.charuco import BoardView, CharucoBoard
from daq.vision.errors import VisionError
from daq.vision.stereo import triangulate
from robot_drivers.protocols import Pose

FloatArray = NDArray[np.float64]

BOARD = CharucoBoard(columns=9, rows=7, square_m=0.008, marker_m=0.006)
SIZE = (800, 600)  # the middle of the sensor suffices, and is rendered faster
LEFT, RIGHT = (
    replace(camera, width=SIZE[0], height=SIZE[1], principal_point=(centre, 297.0))
    for camera, centre in ((flea2_pair().left, 405.0), (flea2_pair().right, 391.0))
)
PX_PER_SQUARE = 64
FLAT = frames.pose((0.028, 0.036, 0.005), Rotation.from_matrix([[0, -1, 0], [-1, 0, 0], [0, 0, -1]]))


@cache
def ray_directions(camera: PinholeCamera) -> NDArray[np.float32]:
    grid = np.stack(np.meshgrid(np.arange(0, SIZE[0] + 4, 4), np.arange(0, SIZE[1] + 4, 4)), axis=-1)
    x, y = np.meshgrid(np.arange(SIZE[0]) / 4.0, np.arange(SIZE[1]) / 4.0)
    return cv2.remap(
        camera.rays(grid).astype(np.float32), x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR
    )


def rendered(camera: PinholeCamera, T_tissue_board: Pose, seed: int) -> NDArray[np.uint8]:
    """What the camera sees of the printed board on a grey ground."""
    R_board_tissue = frames.rotation(T_tissue_board.quaternion_wxyz).as_matrix().T
    centre = R_board_tissue @ (camera.centre - T_tissue_board.position)
    directions = ray_directions(camera) @ R_board_tissue.T.astype(np.float32)
    range_m = -centre[2] / directions[..., 2]
    to_px = PX_PER_SQUARE / BOARD.square_m
    x, y = ((centre[axis] + range_m * directions[..., axis]) * to_px - 0.5 for axis in (0, 1))
    print_margin = cv2.copyMakeBorder(
        BOARD.image(PX_PER_SQUARE), 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255
    )
    # the lens's blur first, on the finer print, so that sampling it at the pixels does not alias
    levels = cv2.GaussianBlur(25.0 + 0.75 * print_margin.astype(np.float32), (0, 0), 1.2)
    seen = cv2.remap(
        levels, (x + 40).astype(np.float32), (y + 40).astype(np.float32), cv2.INTER_LINEAR, borderValue=120.0
    )
    noisy = seen + np.random.default_rng(seed).normal(0.0, 1.5, seen.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def poses(count: int) -> list[Pose]:
    """The board flat on the phantom, then held in the hand at many tilts and places."""
    rng = np.random.default_rng(3)
    middle = np.array([0.036, 0.028, 0.0])
    result = [FLAT]
    for _ in range(count - 1):
        tilt = Rotation.from_rotvec([*rng.uniform(-0.65, 0.65, 2), rng.uniform(-0.5, 0.5)])
        rotation = frames.rotation(FLAT.quaternion_wxyz) * tilt
        place = rng.uniform((-0.015, -0.02, -0.03), (0.015, 0.02, 0.05))
        result.append(frames.pose(place - rotation.apply(middle), rotation))
    return result


def seen_pair(T_tissue_board: Pose, seed: int) -> BoardPair:
    left, right = (
        BOARD.detect(rendered(camera, T_tissue_board, 2 * seed + side))
        for side, camera in enumerate((LEFT, RIGHT))
    )
    return left, right


@cache
def report() -> CalibrationReport:
    pairs = [seen_pair(pose, k) for k, pose in enumerate(poses(16))]
    return calibrate(pairs, BOARD, SIZE, reference=0, T_tissue_board=FLAT)


def test_board_corners_are_found_where_they_project() -> None:
    view = BOARD.detect(rendered(LEFT, FLAT, 0))
    assert len(view.numbers) == 48
    corners = frames.rotation(FLAT.quaternion_wxyz).apply(BOARD.corners) + FLAT.position
    errors = view.pixels - LEFT.project(corners[view.numbers])
    assert np.sqrt(np.mean(errors**2)) < 0.06


def test_the_lens_is_recovered_within_its_stated_uncertainty() -> None:
    result = report()
    for camera, truth, std in zip(
        (result.calibration.left, result.calibration.right), (LEFT, RIGHT), result.intrinsics_std, strict=True
    ):
        assert camera.focal_length[0] == pytest.approx(truth.focal_length[0], rel=0.004)
        estimated = np.array([*camera.focal_length, *camera.principal_point])
        true = np.array([*truth.focal_length, *truth.principal_point])
        assert (np.abs(estimated - true) < 5.0 * std[:4]).all()


def test_points_on_the_phantom_are_measured_in_the_tissue_frame() -> None:
    points = np.random.default_rng(1).uniform((-0.03, -0.03, 0.0), (0.03, 0.03, 0.01), (40, 3))
    noise = np.broadcast_to(np.eye(2), (40, 2, 2))
    measured = triangulate(
        report().calibration, LEFT.project(points), RIGHT.project(points), noise, noise
    ).positions
    rms = np.sqrt(np.mean((measured - points) ** 2, axis=0))
    assert rms.max() < 20e-6


def test_residuals_and_held_out_distances_speak_for_the_calibration() -> None:
    result = report()
    assert result.calibration.rms_px < 0.06
    assert len(result.pair_rms_px) == 13
    assert result.pair_rms_px.max() < 0.08
    assert abs(result.held_out_scale) < 1e-4
    assert result.held_out_rms_m < 20e-6


def test_a_board_printed_too_large_shows_in_no_residual_but_in_the_baseline() -> None:
    pairs = [
        (exact_view(LEFT, pose, 2 * k), exact_view(RIGHT, pose, 2 * k + 1))
        for k, pose in enumerate(poses(12))
    ]
    believed = replace(BOARD, square_m=1.01 * BOARD.square_m)
    wrong = calibrate(pairs, believed, SIZE, reference=0, T_tissue_board=FLAT)
    assert wrong.calibration.rms_px < 0.1
    assert wrong.calibration.baseline_m == pytest.approx(1.01 * flea2_pair().baseline_m, rel=2e-3)


def exact_view(camera: PinholeCamera, T_tissue_board: Pose, seed: int) -> BoardView:
    corners = frames.rotation(T_tissue_board.quaternion_wxyz).apply(BOARD.corners) + T_tissue_board.position
    noise = np.random.default_rng(seed).normal(0.0, 0.03, (len(corners), 2))
    return BoardView(np.arange(len(corners)), camera.project(corners) + noise)


def test_what_cannot_be_calibrated_is_refused() -> None:
    with pytest.raises(VisionError, match="0 board corners found"):
        BOARD.detect(np.full((600, 800), 128, dtype=np.uint8))
    pair = exact_view(LEFT, FLAT, 0), exact_view(RIGHT, FLAT, 1)
    with pytest.raises(VisionError, match="3 pairs of views with reference 0"):
        calibrate([pair] * 3, BOARD, SIZE, reference=0, T_tissue_board=FLAT)
    with pytest.raises(VisionError, match="with reference 12"):
        calibrate([pair] * 12, BOARD, SIZE, reference=12, T_tissue_board=FLAT)
    with pytest.raises(ValueError, match="DICT_4X4_100"):
        CharucoBoard(dictionary="DICT_9X9")
    for metres in (0.008e-3, 8.0):
        with pytest.raises(
            ValueError, match=r"mm is on no board, .*; state millimetres as measured on the print"
        ):
            CharucoBoard(square_m=metres, marker_m=0.75 * metres)
    with pytest.raises(ValueError, match="smaller than its squares"):
        CharucoBoard(square_m=0.006, marker_m=0.008)
