"""Effects of the material and of where it is stiffer or softer.

Sizes: 1 is what gap tables call typical; every formula's source is in ``laws`` and ``response``.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from estimator.blind.making.effects.drawing import Draw, FloatArray, Random
from estimator.blind.making.mechanics import response
from estimator.blind.making.mechanics.brick_mesh import Break
from estimator.blind.making.mechanics.laws import (
    Curve,
    Fibres,
    Term,
    exponential,
    limited,
    logarithmic,
    power,
    tension_only,
)
from estimator.blind.making.scenes.scene import SIZE, Drawn, Form, Mechanics, Scene


def _with_terms(*terms: Term) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, mechanics=scene.mechanics.with_terms(*terms))


def _yeoh(random: Random, size: float, base: Mechanics) -> Drawn:
    second = 0.25 * size
    third = 0.1 * size * random.uniform(0, 1)
    terms = Term("isochoric_1", power(2), second), Term("isochoric_1", power(3), third)
    return Drawn({"law": "yeoh", "C2_over_C1": second, "C3_over_C1": third}, _with_terms(*terms))


def _gent(random: Random, size: float, base: Mechanics) -> Drawn:
    limit = 3.0 / size
    argument = str(random.choice(["isochoric_1", "coupled_1"]))
    term = Term(argument, limited(limit))
    return Drawn({"law": "gent", "Jm": limit, "argument": argument}, _with_terms(term))


def _exponential(random: Random, size: float, base: Mechanics) -> Drawn:
    rate = 0.5 * size
    return Drawn({"law": "exponential", "rate": rate}, _with_terms(Term("isochoric_1", exponential(rate))))


def _mooney(random: Random, size: float, base: Mechanics) -> Drawn:
    share = 0.35 * size
    terms = Term("isochoric_2", power(1), share), Term("isochoric_1", power(1), -share)
    return Drawn({"law": "mooney_rivlin", "share_of_second_invariant": share}, _with_terms(*terms))


def _gent_thomas(random: Random, size: float, base: Mechanics) -> Drawn:
    share = 0.3 * size
    terms = Term("isochoric_2", logarithmic(), share), Term("isochoric_1", power(1), -share)
    return Drawn({"law": "gent_thomas", "share_of_second_invariant": share}, _with_terms(*terms))


def _viscous(terms: int, instantaneous: bool) -> Draw:
    """Relaxation with so many elements; the stated modulus is that of a sudden or of a slow stretch."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        relaxed = min(0.2 * size, 0.7)
        split = random.dirichlet(np.full(terms, 4.0)) * relaxed
        low, high = (2.0, 40.0) if terms == 1 else (2.0, 7.0)
        times = [float(np.exp(random.uniform(np.log(low), np.log(high))))]
        times += [float(random.uniform(20.0, 60.0)) for _ in range(terms - 1)]
        # Shares of the instantaneous stiffness, as elements beside a spring that keeps the rest.
        shares = tuple(float(g / (1 - relaxed)) for g in split)
        factor = 1 - relaxed if instantaneous else 1.0

        def change(scene: Scene) -> Scene:
            law = scene.mechanics.law
            law = replace(law, youngs_modulus=law.youngs_modulus * factor)
            return scene.acted_on(relaxation=response.Relaxation(shares, tuple(times)), law=law)

        stated = "instantaneous" if instantaneous else "long-term (relaxed)"
        parameters = {
            "relaxed_fraction": relaxed,
            "term_fraction": split.tolist(),
            "time_constant": times,
            "youngs_modulus_is": stated,
        }
        return Drawn(parameters, change)

    return draw


def _energy_scale(random: Random, base: Mechanics) -> float:
    """An energy density that the tissue near the grasp passes in the first retraction, J/m³."""
    return base.law.youngs_modulus * float(np.exp(random.uniform(np.log(0.005), np.log(0.03))))


def _pseudo_elastic(random: Random, size: float, base: Mechanics) -> Drawn:
    strength, scale = min(0.25 * size, 0.8), _energy_scale(random, base)
    softening = response.pseudo_elastic(strength, scale)
    parameters = {"kind": "pseudo-elastic", "strength": strength, "energy_scale": scale}
    return Drawn(parameters, lambda scene: scene.acted_on(softening=softening))


def _damage(random: Random, size: float, base: Mechanics) -> Drawn:
    strength, scale = min(0.3 * size, 0.8), _energy_scale(random, base)
    softening = response.damage(strength, scale)
    parameters = {"kind": "continuum damage", "strength": strength, "energy_scale": scale}
    return Drawn(parameters, lambda scene: scene.acted_on(softening=softening))


def _set(creeps: bool) -> Draw:
    """A share of the largest strain that stays, at once or after a time under load."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        share = min(0.06 * size, 0.4)
        time = float(random.uniform(5.0, 20.0)) if creeps else 0.0
        law = response.PermanentSet(share, time)
        parameters = {"share_of_largest_strain": share, "time_constant": time}
        return Drawn(parameters, lambda scene: scene.acted_on(permanent_set=law))

    return draw


def _fibres(name: str, curve_of: Callable[[Random], Curve]) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        angle = float(random.uniform(-np.pi / 2, np.pi / 2))
        weight = 0.3 * size
        fibres = Fibres((np.cos(angle), np.sin(angle), 0.0), curve_of(random), weight)
        parameters = {"kind": name, "angle_from_x": angle, "added_modulus_ratio": weight}
        return Drawn(parameters, lambda scene: replace(scene, mechanics=scene.mechanics.with_fibres(fibres)))

    return draw


def _region(shape: str, stiffer: bool) -> Draw:
    """A cylinder through the thickness, a ball with soft edges, or a box, of another modulus."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        centre = np.array([random.uniform(-0.03, 0.012), random.uniform(-0.028, 0.028), 0.0])
        radius = float(random.uniform(0.008, 0.016))
        ratio = 1 + 1.0 * size if stiffer else 1 / (1 + 0.8 * size)
        edge = float(random.uniform(0.001, 0.002)) if shape == "soft_ball" else 0.0

        def factor(points: FloatArray) -> FloatArray:
            away = points - centre
            if shape == "box":
                inside = np.abs(away[:, :2]).max(axis=1) < radius * np.sqrt(np.pi) / 2
            elif shape == "cylinder":
                inside = np.linalg.norm(away[:, :2], axis=1) < radius
            else:
                depth = (radius - np.linalg.norm(away, axis=1)) / edge
                return 1 + (ratio - 1) * (1 + np.tanh(depth)) / 2
            return np.where(inside, ratio, 1.0)

        edges = [tuple(Break(float(c + side * radius), 0.002) for side in (-1, 1)) for c in centre[:2]]

        def change(scene: Scene) -> Scene:
            mechanics = scene.mechanics.with_stiffness(factor).with_breaks(*edges)
            return replace(scene, mechanics=replace(mechanics, has_region=True))

        where = {"centre": centre.tolist(), "radius": radius}
        parameters = {"shape": shape, "radius": radius, "stiffness_ratio": ratio, "edge_width": edge}
        return Drawn(parameters, change, where)

    return draw


def _gradient(axis: int, curve: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        change_across = float(random.choice([-1.0, 1.0])) * min((0.6 if axis == 2 else 0.25) * size, 1.6)

        def factor(points: FloatArray) -> FloatArray:
            place = points[:, axis] / SIZE[axis]
            return np.exp(change_across * place) if curve == "exponential" else 1 + change_across * place

        parameters = {"axis": "xyz"[axis], "curve": curve, "relative_change_across": change_across}
        return Drawn(
            parameters, lambda scene: replace(scene, mechanics=scene.mechanics.with_stiffness(factor))
        )

    return draw


FORMS: dict[str, tuple[Form, ...]] = {
    "strain_stiffening": (
        Form("yeoh", _yeoh, (0.05, 8.0), family="near"),
        Form("gent", _gent, (0.05, 3.0)),
        Form("exponential", _exponential, (0.05, 6.0), family="near"),
    ),
    "second_invariant": (
        Form("mooney_rivlin", _mooney, (0.1, 2.6)),
        Form("gent_thomas", _gent_thomas, (0.1, 3.0), family="near"),
    ),
    "viscoelasticity": (
        Form("one_term_relaxed", _viscous(1, instantaneous=False), (0.05, 3.0)),
        Form("two_terms_relaxed", _viscous(2, instantaneous=False), (0.05, 3.0)),
        Form("one_term_instantaneous", _viscous(1, instantaneous=True), (0.05, 3.0)),
    ),
    "stress_softening": (
        Form("pseudo_elastic", _pseudo_elastic, (0.05, 3.0), family="near"),
        Form("continuum_damage", _damage, (0.05, 2.5)),
    ),
    "permanent_set": (
        Form("at_once", _set(creeps=False), (0.02, 4.0)),
        Form("creeping", _set(creeps=True), (0.02, 6.0), family="near"),
    ),
    "anisotropy": (
        Form("quadratic", _fibres("quadratic", lambda random: power(2)), (0.02, 6.0)),
        Form(
            "tension_only",
            _fibres("tension only", lambda random: tension_only(float(random.uniform(0.2, 1.0)))),
            (0.02, 6.0),
        ),
    ),
    "inhomogeneity": (
        Form("stiff_cylinder", _region("cylinder", stiffer=True), (0.05, 6.0)),
        Form("soft_cylinder", _region("cylinder", stiffer=False), (0.05, 6.0)),
        Form("stiff_ball", _region("soft_ball", stiffer=True), (0.05, 8.0), family="near"),
        Form("stiff_box", _region("box", stiffer=True), (0.05, 6.0), family="near"),
        Form("soft_box", _region("box", stiffer=False), (0.05, 6.0), family="near"),
    ),
    "modulus_gradient": (
        Form("along_x", _gradient(0, "linear"), (0.02, 5.0)),
        Form("along_y", _gradient(1, "linear"), (0.02, 5.0)),
        Form("along_x_exponential", _gradient(0, "exponential"), (0.02, 6.0)),
        Form("through_thickness", _gradient(2, "linear"), (0.1, 2.6)),
    ),
}
