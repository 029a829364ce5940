"""What the vision does on rendered images of a demanding scene, in figures.

``python -m daq.virtual_rig.vision_benchmark`` prints the rms error of the bead centres for each disturbance by itself
and for all together, the error of the triangulated positions, and how many beads keep their names through 30 mm of
motion while some are hidden.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from daq.virtual_rig.layout import SPECIMEN, placed_beads
from daq.virtual_rig.rendering.scene import Scene, SceneSettings, flea2_pair
from daq.vision.beads import BeadSettings, detect_beads
from daq.vision.fiducials import FiducialSettings, FiducialTracker
from robot_drivers.cameras.pixel_formats import RawPixelFormat
from robot_drivers.protocols import FloatArray

PLAIN = SceneSettings(blur=0.8, shading=0.0, vignetting=0.0)
DISTURBANCES: Mapping[str, SceneSettings] = {
    "plain": PLAIN,
    "blur": replace(PLAIN, blur=1.3),
    "noise": replace(PLAIN, read_noise=3.0),
    "shading": replace(PLAIN, shading=0.4, vignetting=0.4),
    "glare": replace(PLAIN, glare=0.5),
    "Bayer mosaic": replace(PLAIN, pixel_format="bayer_rggb8"),
}
TOGETHER = SceneSettings(
    blur=0.8, read_noise=2.0, shading=0.4, vignetting=0.4, glare=0.5, pixel_format="bayer_rggb8"
)
"""Everything at once, in focus."""

DEFOCUSED_AND_GLOSSY = replace(TOGETHER, blur=1.3)
"""The hardest: a highlight on the rim, blurred as wide as half of the bead, hides where the rim is."""

MOTION_M = 0.03
IMAGES = 41

_IMAGE_PERIOD_S = 0.1
_HIDDEN_SHARE = 0.02
_HIDDEN_IMAGES = 5
_WRONG_NAME_M = 2e-3


@dataclass(frozen=True, slots=True)
class TrackingFigures:
    """How a tracked motion went.

    Attributes
    ----------
    moved_m : the way of the bead that moved most
    shown, named, wrong : beads shown to the cameras, of these named, and of these under another's name
    rms_m : (3,) error of the named ones along x, y, z of the tissue frame
    rejected : by stage and reason
    """

    moved_m: float
    shown: int
    named: int
    wrong: int
    rms_m: FloatArray
    rejected: Mapping[str, int]


def centre_rms_px(settings: SceneSettings, images: int = 4, seed: int = 1) -> tuple[float, int]:
    """Return the rms error of a coordinate of the bead centres in the left image, and how many beads were missed."""
    camera = flea2_pair().left
    scene = Scene(camera, settings, seed)
    beads = replace(BeadSettings(), pixel_format=_pixel_format(settings))
    rng = np.random.default_rng(seed)
    errors, missed = [], 0
    for exposure in range(images):
        positions = np.array(placed_beads(seed)) + rng.uniform(-0.004, 0.004, (len(SPECIMEN.fiducials_m), 3))
        found = detect_beads(scene.render(positions, exposure), beads).centres
        offsets = found[None] - camera.project(positions)[:, None]
        nearest = offsets[np.arange(len(positions)), np.linalg.norm(offsets, axis=2).argmin(axis=1)]
        near = np.linalg.norm(nearest, axis=1) < 1.0
        missed += int(np.sum(~near))
        errors.append(nearest[near])
    return float(np.sqrt(np.mean(np.square(np.concatenate(errors))))), missed


def track(settings: SceneSettings, seed: int = 1) -> TrackingFigures:
    """Follow the beads through a pull of 30 mm in which each is hidden for some images now and then."""
    pair = flea2_pair()
    scenes = [Scene(camera, settings, 2 * seed + side) for side, camera in enumerate((pair.left, pair.right))]
    vision = FiducialSettings(beads=replace(BeadSettings(), pixel_format=_pixel_format(settings)))
    tracker = FiducialTracker(pair, SPECIMEN.fiducials_m, vision)
    rest, rng = np.array(placed_beads(seed)), np.random.default_rng(seed)
    hidden_until = np.zeros(len(rest), dtype=np.int64)
    errors, rejected = [], Counter[str]()
    shown = named = wrong = 0
    for image in range(IMAGES):
        truth = pulled(rest, MOTION_M * image / (IMAGES - 1))
        if image:
            hidden_until[rng.random(len(rest)) < _HIDDEN_SHARE] = image + _HIDDEN_IMAGES
        visible = hidden_until <= image
        seen = np.where(visible[:, None], truth, np.nan)
        left, right = (scene.render(seen, image) for scene in scenes)
        observation = tracker.update(left, right, image * _IMAGE_PERIOD_S)
        error = observation.positions - truth
        found = np.isfinite(error).all(axis=1)
        shown += int(visible.sum())
        named += int(found.sum())
        wrong += int(np.sum(np.linalg.norm(error[found], axis=1) > _WRONG_NAME_M))
        errors.append(error[found])
        rejected.update(observation.rejected)
    rms = np.sqrt(np.mean(np.square(np.concatenate(errors)), axis=0))
    moved = float(np.linalg.norm(truth - rest, axis=1).max())
    return TrackingFigures(moved, shown, named, wrong, rms, rejected)


def pulled(rest: FloatArray, way_m: float) -> FloatArray:
    """Return the beads (n, 3) when the grasp was pulled along x: all of the way there, none at the anchors."""
    moved = rest.copy()
    share = np.clip((rest[:, 0] + 0.05) / 0.078, 0.0, 1.0) * (1.0 - 0.4 * np.abs(rest[:, 1]) / 0.03)
    moved[:, 0] += way_m * share / share.max()
    moved[:, 1] *= 1.0 - 3.0 * way_m * share
    return moved


def _pixel_format(settings: SceneSettings) -> RawPixelFormat:
    return next(known for known in get_args(RawPixelFormat) if known == settings.pixel_format)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(
        prog="python -m daq.virtual_rig.vision_benchmark", description=main.__doc__
    )
    parser.add_argument("--seed", type=int, default=1, help="of scenes and noise (default: %(default)s)")
    seed: int = parser.parse_args().seed
    scenes = {**DISTURBANCES, "all together": TOGETHER, "all together, out of focus": DEFOCUSED_AND_GLOSSY}
    for name, settings in scenes.items():
        rms, missed = centre_rms_px(settings, seed=seed)
        sys.stdout.write(f"bead centres, {name}: {rms:.4f} px rms, {missed} of 64 missed\n")
    for name, settings in {"standard scene": SceneSettings(), "all together": TOGETHER}.items():
        told = track(settings, seed)
        x, y, z = (1e6 * told.rms_m).tolist()
        sys.stdout.write(
            f"30 mm of motion, {name}: {told.named} of {told.shown} shown beads named, {told.wrong} wrongly, "
            f"farthest {1e3 * told.moved_m:.1f} mm; rms x {x:.1f}, y {y:.1f}, z {z:.1f} µm\n"
            f"  rejected: {', '.join(f'{why} {count}' for why, count in sorted(told.rejected.items())) or 'nothing'}\n"
        )


if __name__ == "__main__":
    main()
