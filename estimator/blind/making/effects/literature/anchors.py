"""Anchors that give or have come off: by uneven, stiffening, slack or creeping springs, and anywhere on any face."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.effects.drawing import (
    Draw,
    FloatArray,
    Random,
    acted_as,
    drawn_between,
    drawn_sign,
)
from estimator.blind.making.mechanics.brick_mesh import Break
from estimator.blind.making.mechanics.layers import Creeping, OverFace, Peeling, Springs, everywhere
from estimator.blind.making.mechanics.response import Instant
from estimator.blind.making.mechanics.surfaces import Traction
from estimator.blind.making.scenes.scene import SIZE, Drawn, Form, Mechanics, Scene

_HALF = SIZE[0] / 2
# Of what holds, over the tissue's modulus, 1/m: 25 micrometres of tissue would yield as much.
_RIGID = 4e4


def _on_x(points: FloatArray) -> NDArray[np.bool_]:
    return np.asarray(points[:, 0] < -_HALF + 1e-6)


def _layer(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        length = 0.006 * size
        normal = base.law.youngs_modulus / length
        tangential = normal * drawn_between(random, 0.3, 1.0)
        local: OverFace = everywhere
        stiffens_at, slack = None, 0.0
        if kind == "stiffening":
            stiffens_at = drawn_between(random, 5e-4, 2e-3)
        elif kind == "slack":
            slack, normal = min(0.0006 * size, 0.004), base.law.youngs_modulus / 0.002
            tangential = normal
        elif kind == "uneven":
            local = _uneven(random)
        elif kind == "soft_patch":
            local = _soft_patch(random)

        def anchor(axis: int) -> Traction:
            return Springs(axis, normal, tangential, local, stiffens_at, slack)

        parameters: dict[str, object] = {
            "kind": kind,
            "normal_stiffness": normal,
            "tangential_stiffness": tangential,
            "stiffens_at": stiffens_at or 0.0,
            "slack": slack,
        }
        return acted_as(parameters, anchor=anchor)

    return draw


def _uneven(random: Random) -> OverFace:
    """A smooth random factor along the faces, from a third to three times."""
    waves, phases = random.uniform(40.0, 160.0, 3), random.uniform(0, 2 * np.pi, 3)
    return lambda points: np.exp(
        0.55 * np.sin((points[:, 0] + points[:, 1])[:, None] * waves + phases).sum(axis=1) / np.sqrt(1.5)
    )


def _soft_patch(random: Random) -> OverFace:
    """Stiff but for a stretch of the face along y."""
    centre, half = float(random.uniform(-0.03, 0.03)), float(random.uniform(0.008, 0.02))
    return lambda points: np.where(np.abs(points[:, 1] - centre) < half, 1.0, 12.0)


def _each_its_own(random: Random, size: float, base: Mechanics) -> Drawn:
    """Either face on its own springs; or one alone gives, where there are two."""
    lengths = [0.006 * size * drawn_between(random, 0.2, 1.0), 0.006 * size]
    if random.integers(2):
        lengths.reverse()

    def anchor(axis: int) -> Traction:
        stiffness = base.law.youngs_modulus / lengths[axis]
        return Springs(axis, stiffness, stiffness)

    return acted_as({"kind": "each its own", "equivalent_length": lengths}, anchor=anchor)


def _creeping(random: Random, size: float, base: Mechanics) -> Drawn:
    """Putty or tape: it gives little at once, and goes on giving."""
    length, yields, time = 0.002 * size, drawn_between(random, 1.0, 5.0), drawn_between(random, 3.0, 40.0)
    law = Creeping(base.law.youngs_modulus / length, yields, time)
    parameters: dict[str, object] = {
        "kind": "creeping",
        "length_at_once": length,
        "yields": yields,
        "time_constant": time,
    }
    return acted_as(parameters, anchor=lambda axis: law)


def _free(
    parameters: dict[str, object], free: Callable[[FloatArray], NDArray[np.bool_]], breaks: Break | None
) -> Drawn:
    """Part of the anchored faces is not attached, throughout."""

    def change(scene: Scene) -> Scene:
        if breaks is not None:
            scene = replace(scene, mechanics=scene.mechanics.with_breaks(y=(breaks,)))
        return scene.acted_on(bonded=lambda points: ~free(points))

    return Drawn(parameters, change)


def _second_face(random: Random, size: float, base: Mechanics) -> Drawn:
    """A share of the face at y where there are two; else of the one there is."""
    length, side = min(0.02 * size, 0.08), drawn_sign(random)

    def free(points: FloatArray) -> NDArray[np.bool_]:
        if base.two_sides:
            return np.asarray(
                (points[:, 1] > _HALF - 1e-6) & (side * points[:, 0] > _HALF - length) & ~_on_x(points)
            )
        return np.asarray(_on_x(points) & (side * points[:, 1] > _HALF - length))

    face = "y = 0.05" if base.two_sides else "x = -0.05"
    parameters: dict[str, object] = {
        "face": face,
        "free_length": length,
        "end": "upper" if side > 0 else "lower",
    }
    return _free(parameters, free, None if base.two_sides else Break(side * (_HALF - length), 0.0015))


def _two_stretches(random: Random, size: float, base: Mechanics) -> Drawn:
    """Two stretches of the face at x, apart from each other."""
    length = min(0.012 * size, 0.035)
    first, second = float(random.uniform(-0.045, -0.04)), float(random.uniform(0.002, 0.012))

    def free(points: FloatArray) -> NDArray[np.bool_]:
        inside = [(points[:, 1] > start) & (points[:, 1] < start + length) for start in (first, second)]
        return np.asarray(_on_x(points) & (inside[0] | inside[1]))

    parameters: dict[str, object] = {"face": "x = -0.05", "free_from": [first, second], "free_length": length}

    def change(scene: Scene) -> Scene:
        breaks = tuple(Break(start + way, 0.002) for start in (first, second) for way in (0.0, length))
        scene = replace(scene, mechanics=scene.mechanics.with_breaks(y=breaks))
        return scene.acted_on(bonded=lambda points: ~free(points))

    return Drawn(parameters, change)


def _half_height(random: Random, size: float, base: Mechanics) -> Drawn:
    """The upper or the lower half of the face at x is off, along some of it: glue that did not rise."""
    side, length = drawn_sign(random), min(0.05 * size, 0.1)
    start = float(random.uniform(-_HALF, _HALF - length))

    def free(points: FloatArray) -> NDArray[np.bool_]:
        along = (points[:, 1] > start - 1e-6) & (points[:, 1] < start + length + 1e-6)
        return np.asarray(_on_x(points) & along & (side * points[:, 2] > 1e-6))

    parameters: dict[str, object] = {
        "face": "x = -0.05",
        "half": "upper" if side > 0 else "lower",
        "free_from": start,
        "free_length": length,
    }
    return _free(parameters, free, Break(start + length, 0.0015))


def _weak(random: Random, size: float, base: Mechanics) -> Drawn:
    """A stretch that hangs on by threads of glue: springs, neither rigid nor off."""
    half, centre = min(0.012 * size, 0.045), float(random.uniform(-0.03, 0.03))
    rigid, weak = (
        _RIGID * base.law.youngs_modulus,
        base.law.youngs_modulus / drawn_between(random, 0.01, 0.05),
    )

    def local(points: FloatArray) -> FloatArray:
        return np.where(_on_x(points) & (np.abs(points[:, 1] - centre) < half), weak / rigid, 1.0)

    parameters: dict[str, object] = {"centre_y": centre, "half_length": half, "weak_stiffness": weak}
    where = {"centre": [-_HALF, centre, 0.0], "radius": half}
    drawn = acted_as(parameters, anchor=lambda axis: Springs(axis, rigid, rigid, local))
    return replace(drawn, where=where)


def _peeling(by: str) -> Draw:
    """A front moves along the face at x while an experiment runs, with time or with the pull, and does not go back."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        side, final = drawn_sign(random), min(0.015 * size, 0.08)
        order = int(random.integers(1, 4))
        onset = float(random.uniform(0.006, 0.013)) if by == "travel" else float(random.uniform(5.0, 15.0))
        lasts = 0.006 if by == "travel" else drawn_between(random, 3.0, 20.0)

        def passed(points: FloatArray, instant: Instant) -> NDArray[np.bool_]:
            way = instant.travel if by == "travel" else instant.time
            if instant.order < order:
                return np.zeros(len(points), dtype=bool)
            share = 1.0 if instant.order > order else float(np.clip((way - onset) / lasts, 0.0, 1.0))
            return np.asarray(_on_x(points) & (side * points[:, 1] > _HALF - share * final))

        law = Peeling(_RIGID * base.law.youngs_modulus, passed)
        parameters: dict[str, object] = {
            "front_moves_by": by,
            "from_end": "y > 0" if side > 0 else "y < 0",
            "experiment": order,
            "onset": onset,
            "lasts": lasts,
            "final_length": final,
        }
        where = {"centre": [-_HALF, side * (_HALF - final / 2), 0.0], "radius": final / 2}
        return replace(acted_as(parameters, anchor=lambda axis: law), where=where)

    return draw


FORMS: dict[str, tuple[Form, ...]] = {
    "anchor_compliance": (
        Form("stiffening", _layer("stiffening"), (0.05, 5.0), family="near"),
        Form("each_its_own", _each_its_own, (0.05, 4.0), family="near"),
        Form("slack", _layer("slack"), (0.05, 6.0), family="far"),
        Form("uneven_at_random", _layer("uneven"), (0.05, 4.0), family="near"),
        Form("creeping", _creeping, (0.02, 4.0), family="far"),
        Form("soft_patch", _layer("soft_patch"), (0.1, 6.0), family="far"),
    ),
    "anchor_debonding": (
        Form("any_face", _second_face, (0.1, 4.0), family="exact"),
        Form("two_stretches", _two_stretches, (0.1, 2.9), family="far"),
        Form("peeling_with_time", _peeling("time"), (0.1, 5.0), family="near"),
        Form("hanging_on", _weak, (0.1, 3.5), family="near"),
        Form("half_the_height", _half_height, (0.1, 2.0), family="far"),
        Form("peeling_with_the_pull", _peeling("travel"), (0.1, 5.0), family="near"),
    ),
}
