"""Effects on the tissue that no label of the catalogue means."""

from dataclasses import replace

import numpy as np

from estimator.blind.making.effects.drawing import Draw, FloatArray, Random, drawn_sign
from estimator.blind.making.mechanics.brick_mesh import Break
from estimator.blind.making.mechanics.response import Instant
from estimator.blind.making.mechanics.surfaces import Patch, Pocket
from estimator.blind.making.scenes.scene import GRASP_X, GRASP_Y, SIZE, Drawn, Mechanics, Scene


def _shrinkage(random: Random, size: float, base: Mechanics) -> Drawn:
    each = drawn_sign(random) * 0.003 * size

    def swelling(instant: Instant) -> float:
        return 1 + each * (instant.order - 1)

    return Drawn({"linear_strain_per_experiment": each}, lambda scene: scene.acted_on(swelling=swelling))


def _drawn_disc(random: Random, radii: tuple[float, float]) -> tuple[tuple[float, float], float]:
    """Return centre and radius, m, of a disc on the table, clear of anchor and grasp."""
    centre = (float(random.uniform(-0.03, 0.01)), float(random.uniform(-0.03, 0.03)))
    return centre, float(random.uniform(*radii))


def _under_the_tissue(parameters: dict[str, object], disc: Patch | Pocket, seen_mounted: bool) -> Drawn:
    """Return what a disc on the table does, on a mesh that follows its edges."""
    edges = [tuple(Break(c + s * disc.radius, 0.003) for s in (-1, 1)) for c in disc.centre]
    where = {"centre": [*disc.centre, -SIZE[2] / 2], "radius": disc.radius}

    def change(scene: Scene) -> Scene:
        scene = replace(scene, mechanics=scene.mechanics.with_breaks(*edges))
        return replace(scene.acted_on(table=disc), rest_after_mounting=seen_mounted)

    return Drawn(parameters, change, where)


def _sticky_patch(random: Random, size: float, base: Mechanics) -> Drawn:
    centre, radius = _drawn_disc(random, (0.006, 0.012))
    stiffness = 2e4 * base.law.youngs_modulus / 15e3 * size
    parameters: dict[str, object] = {"stiffness": stiffness, "radius": radius}
    return _under_the_tissue(parameters, Patch(centre, radius, stiffness), seen_mounted=False)


def _air_pocket(random: Random, size: float, base: Mechanics) -> Drawn:
    centre, radius = _drawn_disc(random, (0.008, 0.015))
    stiffness, height = 2e4 * base.law.youngs_modulus / 15e3, 0.0005 * size
    parameters: dict[str, object] = {"stiffness": stiffness, "height": height, "radius": radius}
    return _under_the_tissue(parameters, Pocket(centre, radius, stiffness, height), seen_mounted=True)


def _cut(random: Random, size: float, base: Mechanics) -> Drawn:
    x = float(random.uniform(-0.03, 0.01))
    length = min(0.015 * size, 0.05)
    y = float(random.uniform(-0.03, 0.03 - length)) if length < 0.055 else -0.03
    width = 0.0004

    def factor(points: FloatArray) -> FloatArray:
        in_cut = (np.abs(points[:, 0] - x) < width) & (points[:, 1] > y) & (points[:, 1] < y + length)
        return np.where(in_cut, 2e-3, 1.0)

    def change(scene: Scene) -> Scene:
        across = (Break(x - width, 2 * width), Break(x + width, 2 * width))
        mechanics = scene.mechanics.with_stiffness(factor)
        ends = (Break(y, 0.001), Break(y + length, 0.001))
        return replace(scene, mechanics=mechanics.with_breaks(across, ends))

    where = {"centre": [x, y + length / 2, 0.0], "radius": length / 2}
    return Drawn({"length": length, "across": "x"}, change, where)


def _tear(random: Random, size: float, base: Mechanics) -> Drawn:
    side = drawn_sign(random)
    onset = float(random.uniform(0.006, 0.014))
    final = min(0.006 * size, 0.02)
    width = 0.0008

    def tear(points: FloatArray, instant: Instant) -> FloatArray:
        length = final * np.clip((instant.travel - onset) / 0.005, 0.0, 1.0)
        ahead = np.abs(points[:, 0] - (GRASP_X[0] - width / 2)) < width / 2
        # From the corner of the grasp outwards, just before its front edge.
        outwards = side * points[:, 1] - (GRASP_Y[1] - 0.004)
        torn = ahead & (outwards > 0) & (outwards < length)
        return np.where(torn, 0.02, 1.0)

    def change(scene: Scene) -> Scene:
        breaks = (Break(GRASP_X[0] - width, width),)
        mechanics = scene.mechanics.with_breaks(breaks)
        return replace(scene, mechanics=replace(mechanics, tear=tear))

    where = {"centre": [GRASP_X[0], side * GRASP_Y[1], 0.0], "radius": final}
    return Drawn({"final_length": final, "onset_travel": onset}, change, where)


def _warming(random: Random, size: float, base: Mechanics) -> Drawn:
    per_minute = drawn_sign(random) * 0.03 * size

    def seasons(instant: Instant) -> float:
        # An experiment and the pause after it take about two minutes.
        minutes = 2.0 * (instant.order - 1) + instant.time / 60
        return float(np.exp(per_minute * minutes))

    return Drawn({"log_modulus_per_minute": per_minute}, lambda scene: scene.acted_on(seasons=seasons))


DRAWS: dict[str, tuple[Draw, tuple[float, float]]] = {
    "thermal_shrinkage": (_shrinkage, (0.02, 4.0)),
    "sticky_patch": (_sticky_patch, (0.02, 20.0)),
    "air_pocket": (_air_pocket, (0.02, 8.0)),
    "cut": (_cut, (0.2, 3.3)),
    "tearing": (_tear, (0.3, 3.3)),
    "warming": (_warming, (0.02, 6.0)),
}
