"""The table, gravity, the sheet's thickness, and how it was mounted."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.blind.making.effects.drawing import (
    Draw,
    FloatArray,
    Random,
    acted_as,
    drawn_between,
    drawn_sign,
)
from estimator.blind.making.mechanics.layers import Film, Foam, OverFace, Rubbing, everywhere
from estimator.blind.making.scenes.outline import Uneven
from estimator.blind.making.scenes.retraction import Rows
from estimator.blind.making.scenes.scene import DENSITY, GRAVITY, SIZE, Drawn, Form, Mechanics, Scene

_WEIGHT_PA = DENSITY * GRAVITY * SIZE[2]


def _patches(random: Random) -> OverFace:
    """One inside some discs and nothing between: where the table is dry."""
    centres = random.uniform(-0.04, 0.03, (int(random.integers(2, 6)), 2))
    radii = random.uniform(0.008, 0.02, len(centres))

    def inside(points: FloatArray) -> FloatArray:
        away = np.linalg.norm(points[:, None, :2] - centres, axis=2)
        return np.asarray((away < radii).any(axis=1), dtype=np.float64)

    return inside


def _one_side(random: Random) -> OverFace:
    angle = float(random.uniform(0, 2 * np.pi))
    normal, width = np.array([np.cos(angle), np.sin(angle)]), drawn_between(random, 0.005, 0.03)
    return lambda points: (1 + np.tanh(points[:, :2] @ normal / width)) / 2


def _rubbing(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        limit, slip = 0.5 * size * _WEIGHT_PA, drawn_between(random, 5e-5, 5e-4)
        local: OverFace = everywhere
        sticks, breaks = 1.0, False
        if kind == "patches":
            local, limit = _patches(random), 2 * limit
        elif kind == "one_side":
            local = _one_side(random)
        elif kind == "static_and_kinetic":
            sticks = float(random.uniform(1.4, 3.0))
        else:
            breaks, slip = True, drawn_between(random, 5e-4, 3e-3)
        parameters: dict[str, object] = {
            "kind": kind,
            "shear_limit": limit,
            "sticks": sticks,
            "elastic_slip": slip,
        }
        return acted_as(parameters, table=Rubbing(limit, sticks, local, slip, breaks))

    return draw


def _film(patchy: bool) -> Draw:
    """A film of water or oil: Couette's flow below the sheet."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        drag = 2e4 * size
        law = Film(drag, _patches(random) if patchy else everywhere)
        return acted_as({"kind": "viscous film", "drag": drag, "patchy": patchy}, table=law)

    return draw


def _heavy(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        weight, seen = DENSITY * GRAVITY * min(size, 1.0), bool(random.integers(2))
        parameters: dict[str, object] = {
            "kind": kind,
            "share_of_weight": min(size, 1.0),
            "rest_measured": "after mounting" if seen else "before mounting",
        }
        changes: dict[str, object] = {"body_force": (0.0, 0.0, -weight)}
        if kind == "tilted_table":
            # The table bears the sheet, and its slope draws it aside.
            angle = float(random.uniform(0, 2 * np.pi))
            changes = {"body_force": (0.3 * weight * np.cos(angle), 0.3 * weight * np.sin(angle), 0.0)}
            parameters["direction"] = angle
        elif kind == "overhanging":
            edge = float(random.uniform(-0.03, 0.02))
            changes["heavy"] = lambda points: (points[:, 0] > edge).astype(np.float64)
            parameters["beyond_x"] = edge
        else:
            stiffness = drawn_between(random, 2e4, 2e5)
            changes["table"] = Foam(stiffness)
            parameters["bed_stiffness"] = stiffness
        drawn = acted_as(parameters, **changes)
        return replace(drawn, change=lambda scene: replace(drawn.change(scene), rest_after_mounting=seen))

    return draw


def _uneven(name: str, relative_of: Callable[[FloatArray, FloatArray], FloatArray]) -> Draw:
    """A sheet whose thickness changes with the place: relative_of x, y over half the size, times the amount."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        amount = drawn_sign(random) * min(0.08 * size, 0.45)

        def relative(x: FloatArray, y: FloatArray) -> FloatArray:
            return 1 + amount * relative_of(x / (SIZE[0] / 2), y / (SIZE[1] / 2))

        return acted_as({"kind": name, "relative_change": amount}, outline=Uneven(relative))

    return draw


def _mounted(parameters: dict[str, object], change: Callable[[Rows], Rows], seen: bool) -> Drawn:
    told = {**parameters, "rest_measured": "after mounting" if seen else "before mounting"}

    def applied(scene: Scene) -> Scene:
        return replace(scene, mechanics=scene.mechanics.with_motion(change), rest_after_mounting=seen)

    return Drawn(told, applied)


def _drawn_along(vertical: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        shift = 0.0008 * size * np.array([0.3, drawn_sign(random) * random.uniform(0.3, 1.0), 0.0])
        if vertical:
            shift = 0.0008 * size * np.array([0.5, 0.0, drawn_sign(random) * random.uniform(0.5, 1.5)])
        seen = bool(random.integers(2))
        parameters: dict[str, object] = {"mounting_displacement": shift.tolist()}
        return _mounted(parameters, lambda rows: rows.moved(rows.position + shift), seen)

    return draw


def _twisted(random: Random, size: float, base: Mechanics) -> Drawn:
    """The jaws were closed on tissue that they had turned."""
    axis = int(random.choice([0, 2]))
    angle = drawn_sign(random) * 0.03 * size
    turn = Rotation.from_rotvec(angle * np.eye(3)[axis])
    parameters: dict[str, object] = {"mounting_turn": angle, "about": "xyz"[axis]}
    return _mounted(parameters, lambda rows: rows.turned(rows.rotation * turn), bool(random.integers(2)))


def _shrunk(random: Random, size: float, base: Mechanics) -> Drawn:
    """The sheet has shrunk between anchor and gripper since it was measured."""
    strain = 0.008 * size
    drawn = acted_as({"linear_shrinkage": strain}, swelling=lambda instant: 1 - strain)
    return replace(drawn, change=lambda scene: replace(drawn.change(scene), rest_after_mounting=True))


FORMS: dict[str, tuple[Form, ...]] = {
    "support_friction": (
        Form("viscous_film", _film(patchy=False), (0.02, 20.0), family="far", block=True),
        Form("patches", _rubbing("patches"), (0.02, 4.0), family="far", block=True),
        Form("static_and_kinetic", _rubbing("static_and_kinetic"), (0.02, 3.0), family="near", block=True),
        Form("adhesion_that_breaks", _rubbing("breaking"), (0.02, 5.0), family="far", block=True),
        Form("one_side", _rubbing("one_side"), (0.02, 4.0), family="near", block=True),
        Form("patches_of_film", _film(patchy=True), (0.02, 30.0), family="far", block=True),
    ),
    "gravity_sag": (
        Form("overhanging", _heavy("overhanging"), (0.005, 1.0), least_modulus=9e3, family="far"),
        Form("on_foam", _heavy("on_foam"), (0.005, 1.0), least_modulus=9e3, family="near", block=True),
        Form("tilted_table", _heavy("tilted_table"), (0.005, 1.0), least_modulus=6e3, family="far"),
    ),
    "thickness_error": (
        Form("wedge_along_x", _uneven("wedge", lambda x, y: x), (0.05, 5.0), family="exact", block=True),
        Form(
            "crowned",
            _uneven("crowned", lambda x, y: 1 - 1.5 * (x**2 + y**2)),
            (0.05, 5.0),
            family="near",
            block=True,
        ),
        Form(
            "thicker_edge", _uneven("edge", lambda x, y: 1 + 0.4 * y), (0.05, 4.0), family="near", block=True
        ),
        Form("wedge_along_y", _uneven("wedge", lambda x, y: y), (0.05, 5.0), family="exact", block=True),
    ),
    "prestretch": (
        Form("aside", _drawn_along(vertical=False), (0.05, 6.0), family="exact"),
        Form("twisted", _twisted, (0.02, 5.0), family="far"),
        Form("lifted", _drawn_along(vertical=True), (0.05, 6.0), family="far"),
        Form("shrunk", _shrunk, (0.02, 4.0), family="near"),
    ),
}
