"""From rendered pairs of images to named positions: accuracy at rest, and names through a retraction."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.virtual_rig.rendering.scene import Scene, SceneSettings, flea2_pair
from daq.vision.beads import BeadSettings
from daq.vision.errors import VisionError
from daq.vision.fiducials import FiducialObservation, FiducialSettings, FiducialTracker, average_rest

FloatArray = NDArray[np.float64]

PAIR = flea2_pair()
GRID = np.stack(np.meshgrid([-0.03, -0.01, 0.01, 0.03], [-0.03, -0.01, 0.01, 0.03]), axis=-1).reshape(-1, 2)
REST = np.column_stack([GRID, np.full(16, 0.005)])


@dataclass(frozen=True)
class Rig:
    """Two rendered cameras and a tracker that has not seen anything yet."""

    left: Scene
    right: Scene
    tracker: FiducialTracker

    def measure(self, positions: FloatArray, exposure: int) -> FiducialObservation:
        images = (scene.render(positions, exposure) for scene in (self.left, self.right))
        return self.tracker.update(*images, 0.1 * exposure)


@cache
def scenes(settings: SceneSettings) -> tuple[Scene, Scene]:
    return Scene(PAIR.left, settings, seed=1), Scene(PAIR.right, settings, seed=2)


def rig(scene: SceneSettings, settings: FiducialSettings) -> Rig:
    return Rig(*scenes(scene), FiducialTracker(PAIR, REST, settings))


def placed(seed: int) -> FloatArray:
    return REST + np.random.default_rng(seed).normal(0.0, 0.001, REST.shape)


def retracted(rest: FloatArray, pull_m: float) -> FloatArray:
    moved = rest.copy()
    share = np.clip((rest[:, 0] + 0.05) / 0.08, 0.0, None) * np.exp(-((rest[:, 1] / 0.06) ** 2))
    moved[:, 0] += pull_m * share
    moved[:, 2] += 0.2 * pull_m * share
    return moved


@pytest.mark.parametrize(
    ("scene", "settings"),
    [
        pytest.param(SceneSettings(), FiducialSettings(), id="mono"),
        pytest.param(
            SceneSettings(bead_shape="sphere", glare=0.5), FiducialSettings(), id="balls with glare"
        ),
        pytest.param(
            SceneSettings(pixel_format="bayer_rggb8"),
            FiducialSettings(beads=BeadSettings(pixel_format="bayer_rggb8")),
            id="bayer",
        ),
    ],
)
def test_positions_are_true_to_20_um_across_and_60_um_in_depth(
    scene: SceneSettings, settings: FiducialSettings
) -> None:
    errors = []
    laboratory = rig(scene, settings)
    for exposure in range(4):
        truth = retracted(placed(8), 0.001 * exposure)
        observation = laboratory.measure(truth, exposure)
        assert np.isfinite(observation.positions).all()
        errors.append(observation.positions - truth)
    rms = np.sqrt(np.mean(np.square(errors), axis=(0, 1)))
    assert rms[:2].max() < 20e-6
    assert rms[2] < 60e-6


def test_names_survive_a_retraction_of_30_mm_with_beads_out_of_sight() -> None:
    rest = placed(9)
    laboratory = rig(SceneSettings(), FiducialSettings())
    hidden_from_until = {6: (3, 9), 7: (5, 8), 11: (2, 6), 0: (10, 14)}
    seen = 0
    for exposure in range(21):
        truth = retracted(rest, 0.0015 * exposure)
        shown = truth.copy()
        for bead, (start, end) in hidden_from_until.items():
            if start <= exposure < end:
                shown[bead] = np.nan
        observation = laboratory.measure(shown, exposure)
        visible = np.isfinite(shown[:, 0])
        assert np.isnan(observation.positions[~visible]).all()
        errors = np.linalg.norm(observation.positions - truth, axis=1)
        assert np.nanmax(errors) < 2e-4, "no bead under another's name"
        seen += int(np.isfinite(errors).sum())
    assert np.linalg.norm(truth - rest, axis=1).max() > 0.025
    assert seen >= 0.98 * (21 * 16 - 17)


def test_exchanged_cameras_are_refused_and_not_measured() -> None:
    laboratory = rig(SceneSettings(), FiducialSettings())
    left, right = (scene.render(REST, 0) for scene in (laboratory.left, laboratory.right))
    with pytest.raises(VisionError, match="check that the calibration is in the tissue frame"):
        laboratory.tracker.update(right, left, 0.0)


def test_rejections_are_told_by_stage_and_reason() -> None:
    laboratory = rig(SceneSettings(), FiducialSettings())
    truth = placed(10)
    laboratory.measure(truth, 0)
    shown_left, shown_right = truth.copy(), truth.copy()
    shown_left[2] = np.nan
    observation = laboratory.tracker.update(
        laboratory.left.render(shown_left, 1), laboratory.right.render(shown_right, 1), 0.1
    )
    assert np.isnan(observation.positions[2]).all()
    assert observation.rejected["stereo: no partner"] == 1


def observed(positions: FloatArray) -> FiducialObservation:
    return FiducialObservation(0.0, positions, np.zeros((len(positions), 3, 3)), {})


def test_the_average_at_rest_leaves_out_what_was_not_seen() -> None:
    noise = np.random.default_rng(0).normal(0.0, 1e-5, (12, 16, 3))
    observations = [observed(placed(1) + one) for one in noise]
    observations[3].positions[5] = np.nan
    mean = average_rest(observations)
    assert np.abs(mean - placed(1)).max() < 1.5e-5


def test_a_rest_that_moves_or_is_never_seen_is_refused() -> None:
    moving = [observed(retracted(REST, 0.001 * k)) for k in range(3)]
    with pytest.raises(VisionError, match="moves by"):
        average_rest(moving)
    unseen = REST.copy()
    unseen[4] = np.nan
    with pytest.raises(VisionError, match="fiducials 4 are in none of 2 pairs"):
        average_rest([observed(unseen)] * 2)
    with pytest.raises(VisionError, match="no images"):
        average_rest([])


def test_rest_can_be_averaged_from_still_pairs() -> None:
    laboratory = rig(SceneSettings(), FiducialSettings())
    truth = placed(2)
    mean = average_rest([laboratory.measure(truth, exposure) for exposure in range(4)])
    assert np.sqrt(np.mean((mean - truth) ** 2)) < 20e-6
