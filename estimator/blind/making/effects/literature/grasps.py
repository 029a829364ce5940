"""Jaws in which tissue slides, that give, or that hold another patch than stated."""

from dataclasses import replace

import numpy as np

from estimator.blind.making.effects.drawing import (
    Draw,
    FloatArray,
    Random,
    acted_as,
    drawn_between,
    drawn_sign,
)
from estimator.blind.making.mechanics.grip import Evenness, Grip, Jaws, Jumping
from estimator.blind.making.mechanics.jaws import CreepingSprings, Flexure, Groove
from estimator.blind.making.scenes.scene import GRASP_X, GRASP_Y, Drawn, Form, Mechanics

_RIGID_N_M, _RIGID_NM = 1e6, 1e4


def _pull(base: Mechanics) -> float:
    """What a retraction of 20 mm takes, roughly, N."""
    return base.law.youngs_modulus / 15e3 * (2.9 if base.two_sides else 2.3)


def _gripped(parameters: dict[str, object], grip: Grip) -> Drawn:
    return acted_as(parameters, grip=grip)


def _threshold(random: Random, size: float, base: Mechanics) -> float:
    return _pull(base) * float(np.clip(1 - 0.12 * size, 0.12, 0.98))


def _rigid_plastic(random: Random, size: float, base: Mechanics) -> Drawn:
    """Coulomb's law with a constant normal force: once it slides, the pull does not rise."""
    threshold = _threshold(random, size, base)
    return _gripped(
        {"kind": "rigid-plastic", "threshold_force": threshold}, Jaws(threshold, 0.3 * _pull(base))
    )


def _film(exponent: bool) -> Draw:
    """A wet film without a threshold: the tissue creeps along the pull as long as it is pulled (Norton 1929)."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        power = float(random.uniform(1.5, 3.5)) if exponent else 1.0
        # So viscous that the usual pull lets it creep by 1.5 mm in a minute.
        speed = 0.0015 * size / 60
        viscosity = _pull(base) / speed ** (1 / power)
        grip = Groove(0, 0.0, 0.0, viscosity, power)
        return _gripped({"kind": "film", "viscosity": viscosity, "exponent": power}, grip)

    return draw


def _partial(graded: bool) -> Draw:
    """Tissue slides more where the jaws hold it less: from front to rear, or from one side to the other."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        threshold, hardening = _threshold(random, size, base), _pull(base) * float(random.uniform(5.0, 60.0))
        axis, side, least = int(random.integers(2)), drawn_sign(random), float(random.uniform(0.0, 0.4))

        def graded_share(local: FloatArray) -> FloatArray:
            return least + (1 - least) * np.clip((1 + side * local[:, axis] / 0.01) / 2, 0.0, 1.0)

        def half(local: FloatArray) -> FloatArray:
            return np.where(side * local[:, axis] > 0, 1.0, least)

        parameters: dict[str, object] = {
            "kind": "partial",
            "threshold_force": threshold,
            "hardening": hardening,
            "across": "xy"[axis],
            "least_share": least,
            "graded": graded,
        }
        share: Evenness = graded_share if graded else half
        return _gripped(parameters, Jaws(threshold, hardening, 0.0, share))

    return draw


def _directional(random: Random, size: float, base: Mechanics) -> Drawn:
    """Grooved jaws: it slides along one of their axes alone."""
    axis = int(random.choice([0, 0, 1]))
    strength = 1.0 if axis == 0 else 0.15
    threshold = strength * _threshold(random, size, base)
    hardening = strength * _pull(base) * float(random.uniform(5.0, 60.0))
    parameters: dict[str, object] = {
        "kind": "along one axis",
        "axis": "xy"[axis],
        "threshold_force": threshold,
    }
    return _gripped(parameters, Groove(axis, threshold, hardening))


def _stick_slip(random: Random, size: float, base: Mechanics) -> Drawn:
    threshold, jump = _pull(base) * float(random.uniform(0.35, 0.85)), 0.0004 * size
    parameters: dict[str, object] = {"kind": "stick-slip", "threshold_force": threshold, "jump": jump}
    return _gripped(parameters, Jumping(threshold, jump, most=np.inf))


def _turning(random: Random, size: float, base: Mechanics) -> Drawn:
    """The tissue turns in the jaws about the pull or about z where the torque passes a threshold."""
    axis = int(random.choice([3, 5]))
    torque = 0.02 * _pull(base) * float(np.clip(1 - 0.15 * size, 0.02, 0.95)) * (0.3 if axis == 3 else 0.6)
    hardening = torque * float(random.uniform(0.2, 2.0))
    parameters: dict[str, object] = {"kind": "turning", "about": "xyz"[axis - 3], "threshold_torque": torque}
    return _gripped(parameters, Groove(axis, torque, hardening))


def _stiffness(*values: float) -> FloatArray:
    return np.diag(np.array(values))


def _flexing(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        k = _pull(base) / (1.2e-3 * size)
        parameters: dict[str, object] = {"kind": kind, "stiffness": k}
        plain = _stiffness(k, k, k, _RIGID_NM, _RIGID_NM, _RIGID_NM)
        if kind == "stiffening":
            at = 1.2e-3 * size * drawn_between(random, 0.2, 0.8)
            return _gripped({**parameters, "doubles_at": at}, Flexure(0.4 * plain, at))
        if kind == "play":
            play = 0.0006 * size
            stiff = _stiffness(*3 * [_pull(base) / 1e-4], *3 * [_RIGID_NM])
            return _gripped({"kind": kind, "play": play}, Flexure(stiff, play=play))
        if kind == "tilting":
            turning = _pull(base) / (3.0 * size * drawn_between(random, 0.5, 2.0))
            turns = _stiffness(*3 * [_RIGID_N_M], *3 * [turning])
            return _gripped({"kind": kind, "turning_stiffness": turning}, Flexure(turns))
        # An arm that bends yields aside as well: its principal axes are no axes of the gripper.
        turn, _ = np.linalg.qr(random.standard_normal((3, 3)))
        own = k * np.array([1.0, drawn_between(random, 1.5, 6.0), drawn_between(random, 1.5, 6.0)])
        coupled = np.copy(plain)
        coupled[:3, :3] = turn @ np.diag(own) @ turn.T
        return _gripped({"kind": kind, "matrix": coupled[:3, :3].tolist()}, Flexure(coupled))

    return draw


def _creeping(random: Random, size: float, base: Mechanics) -> Drawn:
    """Padded jaws: they give at once and go on giving."""
    yields, time = drawn_between(random, 0.5, 3.0), drawn_between(random, 2.0, 30.0)
    k = _pull(base) / (0.8e-3 * size)
    parameters: dict[str, object] = {
        "kind": "creeping",
        "stiffness": k,
        "yields": yields,
        "time_constant": time,
    }
    return _gripped(parameters, CreepingSprings(k, _RIGID_NM, yields, time))


def _other_extent(random: Random, size: float, base: Mechanics) -> Drawn:
    """The jaws hold more or less than stated, at the front or at the sides."""
    change = drawn_sign(random) * min(0.002 * size, 0.006)
    front = bool(random.integers(2))
    x = (GRASP_X[0] - change, GRASP_X[1]) if front else GRASP_X
    y = GRASP_Y if front else (GRASP_Y[0] - change, GRASP_Y[1] + change)
    parameters: dict[str, object] = {"kind": "extent", "grasp_x": list(x), "grasp_y": list(y)}
    return acted_as(parameters, grasp_x=x, grasp_y=y)


def _corner(random: Random, size: float, base: Mechanics) -> Drawn:
    """One side alone lies elsewhere: the jaws are askew and hold more on one side."""
    change, side = drawn_sign(random) * min(0.003 * size, 0.007), int(random.integers(2))
    y = (GRASP_Y[0] - change * (side == 0), GRASP_Y[1] + change * (side == 1))
    return acted_as({"kind": "one side", "grasp_y": list(y)}, grasp_y=y)


def _wrong_origin(random: Random, size: float, base: Mechanics) -> Drawn:
    """The jaws hold the stated patch, and the frame's origin is elsewhere: it shows in turns and torques."""
    angle = float(random.uniform(0, 2 * np.pi))
    shift = (0.002 * size * float(np.cos(angle)), 0.002 * size * float(np.sin(angle)))
    drawn = acted_as({"kind": "origin alone", "shift": list(shift)}, centre_shift=shift)
    aside = np.array([*shift, 0.0])
    moved = base.with_motion(lambda rows: rows.moved(rows.position + aside)).motion

    return replace(
        drawn, change=lambda scene: drawn.change(scene).acted_on(motion=(*scene.mechanics.motion, *moved))
    )


FORMS: dict[str, tuple[Form, ...]] = {
    "gripper_slip": (
        Form("rigid_plastic", _rigid_plastic, (0.2, 7.0), family="near"),
        Form("partial_graded", _partial(graded=True), (0.2, 7.0), family="far", block=True),
        Form("film", _film(exponent=False), (0.02, 8.0), family="far"),
        Form("along_one_axis", _directional, (0.2, 7.0), family="near"),
        Form("stick_slip", _stick_slip, (0.05, 4.0), family="far"),
        Form("power_law_film", _film(exponent=True), (0.02, 8.0), family="far"),
        Form("partial_half", _partial(graded=False), (0.2, 7.0), family="far", block=True),
        Form("turning", _turning, (0.2, 6.5), family="far"),
    ),
    "gripper_compliance": (
        Form("stiffening", _flexing("stiffening"), (0.02, 5.0), family="near"),
        Form("oblique_axes", _flexing("oblique"), (0.02, 5.0), family="near"),
        Form("play", _flexing("play"), (0.02, 5.0), family="far"),
        Form("creeping", _creeping, (0.02, 4.0), family="far"),
        Form("tilting", _flexing("tilting"), (0.02, 5.0), family="exact"),
    ),
    "grasp_misplacement": (
        Form("other_extent", _other_extent, (0.1, 3.0), family="exact", block=True),
        Form("wrong_origin", _wrong_origin, (0.02, 6.0), family="exact"),
        Form("one_side", _corner, (0.1, 2.3), family="exact", block=True),
    ),
}
