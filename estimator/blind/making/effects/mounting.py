"""Effects of how the phantom is anchored, grasped, supported and shaped."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.effects.drawing import Draw, FloatArray, Random, drawn_sign
from estimator.blind.making.mechanics.brick_mesh import Break
from estimator.blind.making.mechanics.grip import Grip, Jaws, Jumping, Springs
from estimator.blind.making.mechanics.surfaces import Friction, Glue, Layer, Traction
from estimator.blind.making.scenes.scene import DENSITY, GRAVITY, SIZE, Drawn, Form, Mechanics, Scene

# Of glue before it fails, over the tissue's modulus, 1/m: 25 micrometres of tissue would yield as much, which no
# camera sees and nobody would call a compliant anchor.
_GLUE_STIFFNESS = 4e4


def _pull_force(base: Mechanics) -> float:
    """What a retraction of 20 mm takes, roughly, N: 2.3 N at 15 kPa on one anchored side, more on two."""
    return base.law.youngs_modulus / 15e3 * (2.9 if base.two_sides else 2.3)


def _layer(uneven: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        length = 0.006 * size
        normal = base.law.youngs_modulus / length
        tangential = normal * float(random.uniform(0.35, 0.9))
        softer = float(random.uniform(0.3, 0.8)) if uneven else 0.0

        def anchor(axis: int) -> Traction:
            return Layer(axis, normal, tangential, softer, along=1 - axis)

        parameters = {
            "equivalent_length": length,
            "normal_stiffness": normal,
            "tangential_stiffness": tangential,
            "stiffness_lost_towards_one_end": softer,
        }
        return Drawn(parameters, lambda scene: scene.acted_on(anchor=anchor))

    return draw


def _free_strip(random: Random, size: float, base: Mechanics) -> Drawn:
    length = min(0.012 * size, 0.06)
    side = -1.0 if base.two_sides else drawn_sign(random)
    edge = side * (SIZE[1] / 2 - length)

    def bonded(points: FloatArray) -> NDArray[np.bool_]:
        at_x_face = points[:, 0] < -SIZE[0] / 2 + 1e-6
        return ~(at_x_face & (side * points[:, 1] > side * edge + 1e-6))

    parameters = {"face": "x = -0.05", "free_length": length, "end": "y > 0" if side > 0 else "y < 0"}
    where = {"centre": [-SIZE[0] / 2, side * (SIZE[1] / 2 - length / 2), 0.0], "radius": length / 2}

    def change(scene: Scene) -> Scene:
        scene = replace(scene, mechanics=scene.mechanics.with_breaks(y=(Break(edge, 0.0015),)))
        return scene.acted_on(bonded=bonded)

    return Drawn(parameters, change, where)


def _free_middle(random: Random, size: float, base: Mechanics) -> Drawn:
    length = min(0.03 * size, 0.085)
    centre = float(random.uniform(-0.5, 0.5)) * (SIZE[1] - length) * 0.9
    edges = centre - length / 2, centre + length / 2

    def bonded(points: FloatArray) -> NDArray[np.bool_]:
        at_x_face = points[:, 0] < -SIZE[0] / 2 + 1e-6
        return ~(at_x_face & (points[:, 1] > edges[0] + 1e-6) & (points[:, 1] < edges[1] - 1e-6))

    parameters = {"face": "x = -0.05", "free_from": edges[0], "free_to": edges[1]}
    where = {"centre": [-SIZE[0] / 2, centre, 0.0], "radius": length / 2}

    def change(scene: Scene) -> Scene:
        breaks = tuple(Break(edge, 0.0015) for edge in edges)
        scene = replace(scene, mechanics=scene.mechanics.with_breaks(y=breaks))
        return scene.acted_on(bonded=bonded)

    return Drawn(parameters, change, where)


def _failing_glue(random: Random, size: float, base: Mechanics) -> Drawn:
    # The mean traction at 20 mm is the pull over 1e-3 m²; the weak end lets go under a share of it.
    strength = 3.0 * _pull_force(base) / 1e-3
    weak = float(np.clip(0.25 / size, 0.03, 0.95))
    glue = Glue(_GLUE_STIFFNESS * base.law.youngs_modulus, strength, weak)
    parameters = {"strength": strength, "strength_at_weak_end": weak * strength, "weak_end": "y < 0"}
    where = {"centre": [-SIZE[0] / 2, -SIZE[1] / 4, 0.0], "radius": SIZE[1] / 4}
    return Drawn(parameters, lambda scene: scene.acted_on(anchor=lambda axis: glue), where)


def _with_grip(parameters: dict[str, object], grip: Grip) -> Drawn:
    return Drawn(parameters, lambda scene: scene.acted_on(grip=grip))


def _sliding(creeping: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        pull = _pull_force(base)
        threshold = pull * float(np.clip(1 - 0.12 * size, 0.15, 0.98))
        hardening = pull * float(random.uniform(5.0, 60.0))
        viscosity = pull * float(random.uniform(50.0, 200.0)) if creeping else 0.0
        parameters: dict[str, object] = {
            "threshold_force": threshold,
            "hardening": hardening,
            "viscosity": viscosity,
        }
        return _with_grip(parameters, Jaws(threshold, hardening, viscosity))

    return draw


def _jumping(random: Random, size: float, base: Mechanics) -> Drawn:
    threshold = _pull_force(base) * float(random.uniform(0.35, 0.8))
    jump = 0.001 * size
    return _with_grip({"threshold_force": threshold, "jump": jump}, Jumping(threshold, jump))


def _yielding_grip(turns: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        compliance = 1.2e-3 * size / _pull_force(base)
        along = (random.uniform(0.3, 1.0, 3) if turns else np.ones(3)) * compliance
        along[0] = compliance
        # 1 N·m turns it by so much: mostly visible about z, where the gripper pulls off its axis.
        turning = 0.5 * size / _pull_force(base) if turns else 1e-4
        parameters: dict[str, object] = {"m_per_N": along.tolist(), "rad_per_Nm": turning}
        stiffness = tuple((1 / along).tolist())
        return _with_grip(parameters, Springs((stiffness[0], stiffness[1], stiffness[2]), (1 / turning,) * 3))

    return draw


def _misplaced(sideways: bool, centre_too: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        half_turn = np.pi * float(random.integers(2))
        anywhere = float(random.uniform(0, 2 * np.pi))
        angle = half_turn + np.pi / 2 if sideways else anywhere
        length = min(0.0015 * size, 0.009)
        shift = (float(length * np.cos(angle)), float(length * np.sin(angle)))
        parameters = {"shift": list(shift), "yaw": 0.0, "centre_shifts_with_box": centre_too}

        def change(scene: Scene) -> Scene:
            scene = scene.acted_on(grasp_shift=shift)
            if not centre_too:
                return scene
            scene = scene.acted_on(centre_shift=shift)
            return replace(
                scene,
                mechanics=scene.mechanics.with_motion(
                    lambda rows: rows.moved(rows.position + np.array([*shift, 0.0]))
                ),
            )

        return Drawn(parameters, change)

    return draw


def _yawed(random: Random, size: float, base: Mechanics) -> Drawn:
    yaw = drawn_sign(random) * min(0.12 * size, 0.5)
    parameters = {"shift": [0.0, 0.0], "yaw": yaw, "centre_shifts_with_box": False}
    return Drawn(parameters, lambda scene: scene.acted_on(grasp_yaw=yaw))


def _rubbing(adhesive: bool, lifting: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        weight = DENSITY * GRAVITY * SIZE[2]
        coefficient = 0.5 * size if not adhesive else float(random.uniform(0.2, 0.8)) * min(size, 1.5)
        adhesion = max(0.0, (60.0 + 60.0 * random.uniform()) * size) if adhesive else 0.0
        slip = float(random.uniform(1e-4, 3e-4))
        law = Friction(coefficient * weight + adhesion, slip, 2e-3 if lifting else None)
        parameters = {
            "friction_coefficient": coefficient,
            "adhesion_pressure": adhesion,
            "elastic_slip": slip,
            "ends_where_lifted": lifting,
        }
        return Drawn(parameters, lambda scene: scene.acted_on(table=law))

    return draw


def _hanging(after_mounting: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        share = min(size, 1.0)
        tilt = float(random.uniform(-0.15, 0.15)) if after_mounting else 0.0
        weight = DENSITY * GRAVITY * share
        force = (weight * np.sin(tilt), 0.0, -weight * np.cos(tilt))
        parameters = {
            "unsupported_share_of_weight": share,
            "gravity_tilt_about_y": tilt,
            "rest_measured": "after mounting" if after_mounting else "before mounting",
        }
        return Drawn(
            parameters,
            lambda scene: replace(scene.acted_on(body_force=force), rest_after_mounting=after_mounting),
        )

    return draw


def _thick(random: Random, size: float, base: Mechanics) -> Drawn:
    relative = drawn_sign(random) * min(0.08 * size, 0.4)
    thickness = SIZE[2] * (1 + relative)
    return Drawn(
        {"thickness": thickness, "relative_error": relative},
        lambda scene: scene.acted_on(thickness=thickness),
    )


def _tensioned(sideways: bool, after_mounting: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        stretch = 0.0006 * size
        shift = np.array([stretch, stretch * float(random.uniform(-1, 1)) if sideways else 0.0, 0.0])
        parameters = {
            "mounting_displacement": shift.tolist(),
            "rest_measured": "after mounting" if after_mounting else "before mounting",
        }

        def change(scene: Scene) -> Scene:
            moved = scene.mechanics.with_motion(lambda rows: rows.moved(rows.position + shift))
            return replace(scene, mechanics=moved, rest_after_mounting=after_mounting)

        return Drawn(parameters, change)

    return draw


FORMS: dict[str, tuple[Form, ...]] = {
    "anchor_compliance": (
        Form("even_layer", _layer(uneven=False), (0.05, 3.0)),
        Form("uneven_layer", _layer(uneven=True), (0.05, 3.0)),
    ),
    "anchor_debonding": (
        Form("free_end", _free_strip, (0.1, 4.0)),
        Form("free_middle", _free_middle, (0.2, 2.8)),
        Form("failing_glue", _failing_glue, (0.3, 8.0), two_sides=False, family="far"),
    ),
    "gripper_slip": (
        Form("sliding", _sliding(creeping=False), (0.2, 6.0), family="near"),
        Form("creeping", _sliding(creeping=True), (0.2, 6.0), family="near"),
        Form("jump", _jumping, (0.05, 4.0)),
    ),
    "grasp_misplacement": (
        Form("shift_with_centre", _misplaced(sideways=False, centre_too=True), (0.05, 6.0), block=True),
        Form("shift_without_centre", _misplaced(sideways=False, centre_too=False), (0.05, 6.0), block=True),
        Form("sideways", _misplaced(sideways=True, centre_too=False), (0.05, 6.0), block=True),
        Form("yaw", _yawed, (0.05, 4.0), block=True),
    ),
    "gripper_compliance": (
        Form("translation", _yielding_grip(turns=False), (0.02, 4.0)),
        Form("translation_and_rotation", _yielding_grip(turns=True), (0.02, 4.0)),
    ),
    "support_friction": (
        Form("coulomb", _rubbing(adhesive=False, lifting=False), (0.02, 3.0), block=True),
        Form("coulomb_and_adhesion", _rubbing(adhesive=True, lifting=False), (0.02, 3.0), block=True),
        Form(
            "coulomb_where_it_lies",
            _rubbing(adhesive=False, lifting=True),
            (0.02, 3.0),
            family="near",
            block=True,
        ),
    ),
    "gravity_sag": (
        Form("hanging", _hanging(after_mounting=False), (0.005, 1.0), least_modulus=9e3),
        Form("hanging_seen_sagging", _hanging(after_mounting=True), (0.005, 1.0), least_modulus=9e3),
    ),
    "thickness_error": (Form("uniform", _thick, (0.1, 4.0), block=True),),
    "prestretch": (
        Form("along_x", _tensioned(sideways=False, after_mounting=False), (0.05, 5.0)),
        Form("oblique", _tensioned(sideways=True, after_mounting=False), (0.05, 5.0)),
        Form("along_x_seen_mounted", _tensioned(sideways=False, after_mounting=True), (0.05, 8.0)),
    ),
}
