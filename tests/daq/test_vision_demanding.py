"""The vision under everything that disturbs it at once, and the path through a distorting lens."""

from dataclasses import replace

import numpy as np
import pytest

from daq.virtual_rig.layout import SPECIMEN
from daq.virtual_rig.rendering.scene import Scene, SceneSettings, flea2_pair
from daq.virtual_rig.vision_benchmark import (
    DEFOCUSED_AND_GLOSSY,
    DISTURBANCES,
    MOTION_M,
    TOGETHER,
    centre_rms_px,
    track,
)
from daq.vision.beads import BeadSettings, Detections, detect_beads
from daq.vision.camera_model import PinholeCamera, StereoCalibration
from daq.vision.stereo import StereoSettings, match, triangulate

DISTORTED = (-0.31, 0.14, 1.2e-3, -9e-4, 0.0)
POINTS = np.random.default_rng(2).uniform((-0.05, -0.05, 0.0), (0.06, 0.05, 0.01), (40, 3))


def with_lens(distortion: tuple[float, float, float, float, float]) -> StereoCalibration:
    pair = flea2_pair()
    left, right = (replace(camera, distortion=distortion) for camera in (pair.left, pair.right))
    return StereoCalibration(left, right, 0.0)


def noise(count: int) -> np.ndarray:
    return np.broadcast_to(0.02**2 * np.eye(2), (count, 2, 2))


@pytest.mark.parametrize("settings", DISTURBANCES.values(), ids=DISTURBANCES)
def test_each_disturbance_leaves_the_centres_within_three_hundredths_of_a_pixel(
    settings: SceneSettings,
) -> None:
    rms, missed = centre_rms_px(settings, images=2)
    assert rms < 0.03
    assert missed == 0


@pytest.mark.parametrize(
    ("settings", "limit_px"),
    [(TOGETHER, 0.03), (DEFOCUSED_AND_GLOSSY, 0.05)],
    ids=["in focus", "out of focus"],
)
def test_all_disturbances_together_leave_them_within_a_twentieth(
    settings: SceneSettings, limit_px: float
) -> None:
    rms, missed = centre_rms_px(settings)
    assert rms < limit_px
    assert missed == 0


def test_names_and_accuracy_survive_30_mm_under_all_disturbances_with_beads_hidden() -> None:
    told = track(TOGETHER)
    assert told.moved_m == pytest.approx(MOTION_M, rel=0.01)
    assert told.shown < 41 * len(SPECIMEN.fiducials_m), "some beads are hidden for some images"
    assert told.wrong == 0
    assert told.named >= 0.99 * told.shown
    assert told.rms_m[:2].max() < 20e-6
    assert told.rms_m[2] < 60e-6


def test_every_detection_is_used_or_counted_with_its_reason() -> None:
    rng = np.random.default_rng(4)
    pair = flea2_pair()
    left_px = np.vstack([pair.left.project(POINTS[:20]), rng.uniform(100, 800, (7, 2))])
    right_px = np.vstack([pair.right.project(POINTS[2:20]), rng.uniform(100, 800, (9, 2))])
    left, right = (
        Detections(px, noise(len(px)), np.full(len(px), 4.0), np.full(len(px), 90.0), {})
        for px in (left_px, right_px)
    )
    told = match(pair, left, right, StereoSettings())
    used = 2 * (len(told.left) + told.rejected.get("ambiguous pair", 0))
    assert used + told.rejected["no partner"] == len(left) + len(right)


def test_beads_seen_through_a_distorting_lens_are_measured_where_they_are() -> None:
    pair = with_lens(DISTORTED)
    points = triangulate(
        pair, pair.left.project(POINTS), pair.right.project(POINTS), noise(40), noise(40)
    ).positions
    np.testing.assert_allclose(points, POINTS, atol=1e-9)


def test_a_lens_that_is_taken_for_ideal_shifts_the_beads() -> None:
    seen, believed = with_lens(DISTORTED), with_lens((0.0,) * 5)
    points = triangulate(
        believed, seen.left.project(POINTS), seen.right.project(POINTS), noise(40), noise(40)
    ).positions
    assert np.linalg.norm(points - POINTS, axis=1).max() > 1e-4


def test_rendered_beads_lie_where_the_distorted_projection_puts_them() -> None:
    camera = replace(with_lens(DISTORTED).left, width=1288, height=964)
    beads = np.array(SPECIMEN.fiducials_m)
    detections = detect_beads(Scene(camera, SceneSettings(), seed=3).render(beads, 0), BeadSettings())
    truth = camera.project(beads)
    errors = np.linalg.norm(truth[:, None] - detections.centres, axis=2).min(axis=1)
    assert errors.max() < 0.15
    straight = replace(camera, distortion=(0.0,) * 5).project(beads)
    assert np.linalg.norm(truth - straight, axis=1).max() > 0.5


def test_undistortion_undoes_distortion_and_tells_where_it_cannot() -> None:
    camera: PinholeCamera = with_lens(DISTORTED).left
    normalised = np.random.default_rng(5).uniform(-0.3, 0.3, (200, 2))
    np.testing.assert_allclose(camera.undistort(camera.to_pixels(normalised)), normalised, atol=1e-10)
    folded = replace(camera, distortion=(-1.0, 0.0, 0.0, 0.0, 0.0))
    assert np.isnan(folded.undistort([[1e5, 1e5]])).all()
