"""Bead centres on rendered images against the truth, and what is refused as a bead."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from daq.virtual_rig.rendering.scene import Scene, SceneSettings, flea2_pair
from daq.vision.beads import BeadSettings, Detections, detect_beads

# the middle of the sensor suffices, and is rendered faster
CAMERA = replace(flea2_pair().left, width=640, height=480, principal_point=(322.0, 236.0))
GRID = np.stack(np.meshgrid([-0.03, -0.01, 0.01, 0.03], [-0.03, -0.01, 0.01, 0.03]), axis=-1).reshape(-1, 2)
HIDDEN = np.full((1, 3), np.nan)


def bead_positions(rng: np.random.Generator) -> NDArray[np.float64]:
    return np.column_stack([GRID + rng.uniform(-0.004, 0.004, GRID.shape), rng.uniform(0.003, 0.007, 16)])


def errors_px(detections: Detections, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    truth = CAMERA.project(positions)
    distances = np.linalg.norm(truth[:, None] - detections.centres, axis=2)
    assert (distances.min(axis=1) < 1.0).all(), "every bead is found"
    return detections.centres[distances.argmin(axis=1)] - truth


def drawn(shape: str) -> NDArray[np.uint8]:
    """A bright surface with something on it that is no bead."""
    canvas = np.full((8 * 120, 8 * 120), 140, np.uint8)
    centre = (8 * 60, 8 * 60)
    match shape:
        case "speck":
            cv2.circle(canvas, centre, 7, 20, -1)
        case "stain":
            cv2.circle(canvas, centre, 8 * 16, 20, -1)
        case "scratch":
            cv2.line(canvas, (8 * 45, 8 * 50), (8 * 75, 8 * 70), 20, 20)
        case "faint spot":
            cv2.circle(canvas, centre, 8 * 4, 120, -1)
        case "shadow":
            cv2.circle(canvas, centre, 8 * 4, 20, -1)
            canvas = cv2.GaussianBlur(canvas, (0, 0), 8 * 4.0)
        case "ring":
            cv2.circle(canvas, centre, 8 * 6, 20, 8 * 2)
        case "bead on the border":
            cv2.circle(canvas, (8 * 60, 8 * 3), 8 * 4, 20, -1)
    small = cv2.GaussianBlur(cv2.resize(canvas, (120, 120), interpolation=cv2.INTER_AREA), (0, 0), 0.8)
    noise = np.random.default_rng(0).normal(0.0, 1.5, small.shape)
    return np.clip(np.rint(small + noise), 0, 255).astype(np.uint8)


MONO = SceneSettings()
BAYER = replace(MONO, pixel_format="bayer_rggb8")
BRIGHT = replace(MONO, surface_reflectance=0.2, table_reflectance=0.2, bead_reflectance=0.9)


@pytest.mark.parametrize(
    ("scene", "settings", "rms_px"),
    [
        pytest.param(MONO, BeadSettings(), 0.03, id="mono"),
        pytest.param(replace(MONO, read_noise=4.0), BeadSettings(), 0.04, id="noisy"),
        pytest.param(replace(MONO, bead_diameter=0.001), BeadSettings(), 0.03, id="1 mm"),
        pytest.param(replace(MONO, blur=1.3), BeadSettings(), 0.05, id="defocused"),
        pytest.param(replace(MONO, shading=0.4, vignetting=0.4), BeadSettings(), 0.03, id="shaded"),
        pytest.param(replace(MONO, glare=0.5), BeadSettings(), 0.05, id="glare"),
        pytest.param(
            replace(MONO, bead_shape="sphere", glare=0.5), BeadSettings(), 0.05, id="balls with glare"
        ),
        pytest.param(BAYER, BeadSettings(pixel_format="bayer_rggb8"), 0.035, id="bayer"),
        pytest.param(BRIGHT, BeadSettings(polarity="bright"), 0.02, id="bright"),
        pytest.param(replace(MONO, texture=0.0), BeadSettings(), 0.015, id="plain surface"),
    ],
)
def test_centres_are_found_to_a_few_hundredths_of_a_pixel(
    scene: SceneSettings, settings: BeadSettings, rms_px: float
) -> None:
    rng = np.random.default_rng(11)
    camera = Scene(CAMERA, scene, seed=5)
    errors = []
    for exposure in range(4):
        positions = bead_positions(rng)
        detections = detect_beads(camera.render(positions, exposure), settings)
        assert len(detections) == 16
        errors.append(errors_px(detections, positions))
    assert np.sqrt(np.mean(np.square(errors))) < rms_px


def test_the_covariance_tells_the_size_of_the_errors() -> None:
    rng = np.random.default_rng(12)
    camera = Scene(CAMERA, MONO, seed=6)
    squares = []
    for exposure in range(6):
        positions = bead_positions(rng)
        detections = detect_beads(camera.render(positions, exposure), BeadSettings())
        errors = errors_px(detections, positions)
        order = np.linalg.norm(CAMERA.project(positions)[:, None] - detections.centres, axis=2).argmin(axis=1)
        weights = np.linalg.inv(detections.covariances[order])
        squares.append(np.einsum("ni,nij,nj->n", errors, weights, errors))
    assert 0.5 < np.mean(squares) / 2.0 < 2.0


def test_radius_and_contrast_are_those_of_the_bead() -> None:
    scene = replace(MONO, texture=0.0, vignetting=0.0, shading=0.0)
    position = np.array([[0.0, 0.0, 0.005]])
    detections = detect_beads(Scene(CAMERA, scene, seed=1).render(position, 0), BeadSettings())
    tilt = np.arccos(CAMERA.centre[2] / np.linalg.norm(CAMERA.centre))
    radius = 0.00075 * CAMERA.focal_length[0] / CAMERA.to_camera(position[0])[2] * np.sqrt(np.cos(tilt))
    # an edge of radius r under blur s seems to lie s²/2r further in
    assert detections.radii[0] == pytest.approx(radius - scene.blur**2 / (2.0 * radius), rel=0.01)
    light = 0.6 + 0.4 * 0.8  # ambient, and direct at its angle to the disc
    assert detections.contrasts[0] == pytest.approx(scene.white_level * (0.6 - 0.1 * light), rel=0.03)


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        ("speck", "size"),
        ("stain", "size"),
        ("scratch", "shape"),
        ("shadow", "blur"),
        ("ring", "misfit"),
        ("bead on the border", "border"),
    ],
)
def test_what_is_no_bead_is_refused_for_its_reason(shape: str, reason: str) -> None:
    detections = detect_beads(drawn(shape), BeadSettings())
    assert len(detections) == 0
    assert detections.rejected[reason] >= 1


def test_a_faint_spot_is_not_even_a_candidate() -> None:
    detections = detect_beads(drawn("faint spot"), BeadSettings())
    assert len(detections) == 0


def test_an_empty_surface_holds_no_bead() -> None:
    assert len(detect_beads(Scene(CAMERA, MONO, seed=2).render(HIDDEN, 0), BeadSettings())) == 0


def test_beads_are_found_amid_clutter() -> None:
    positions = bead_positions(np.random.default_rng(4))
    image = Scene(CAMERA, MONO, seed=3).render(positions, 0)
    rng = np.random.default_rng(5)
    for _ in range(30):
        x, y = (int(v) for v in rng.uniform((130, 60), (520, 420)))
        if np.linalg.norm(CAMERA.project(positions) - (x, y), axis=1).min() > 25:
            cv2.line(
                image,
                (x, y),
                (x + int(rng.integers(-25, 25)), y + int(rng.integers(10, 20))),
                60,
                2,
                cv2.LINE_AA,
            )
            cv2.circle(image, (x + 12, y - 8), 1, 30, -1, cv2.LINE_AA)
    detections = detect_beads(image, BeadSettings())
    assert np.sqrt(np.mean(errors_px(detections, positions) ** 2)) < 0.03
    assert len(detections) == 16
    assert detections.rejected["shape"] + detections.rejected["size"] >= 15


def test_a_mosaic_taken_for_mono_is_refused() -> None:
    image = Scene(CAMERA, BAYER, seed=4).render(bead_positions(np.random.default_rng(9)), 0)
    assert detect_beads(image, BeadSettings()).rejected["misfit"] == 16


def test_in_a_crowd_of_spots_the_strongest_are_looked_at() -> None:
    positions = bead_positions(np.random.default_rng(10))
    image = Scene(CAMERA, replace(MONO, texture=0.08), seed=4).render(positions, 0)
    detections = detect_beads(image, BeadSettings(most_candidates=20))
    truth = CAMERA.project(positions)
    found = np.linalg.norm(truth[:, None] - detections.centres, axis=2).min(axis=1) < 1.0
    assert found.sum() >= 14
    assert detections.rejected["crowd"] > 0


def test_settings_that_nothing_can_meet_are_refused() -> None:
    with pytest.raises(ValueError, match="radius_px must ascend"):
        BeadSettings(radius_px=(9.0, 2.0))
