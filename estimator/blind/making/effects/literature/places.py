"""Where tissue is stiffer or softer: layers, lobes, vessels, random fields, and courses across the body."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from estimator.blind.making.effects.drawing import Draw, FloatArray, Random, drawn_sign
from estimator.blind.making.mechanics.brick_mesh import Break
from estimator.blind.making.scenes.scene import SIZE, Drawn, Form, Mechanics, Scene

_Factor = Callable[[FloatArray], FloatArray]
_WAVES = 24


def _stiffness(
    parameters: dict[str, object],
    factor: _Factor,
    where: dict[str, object] | None = None,
    region: bool = False,
) -> Drawn:
    def change(scene: Scene) -> Scene:
        mechanics = scene.mechanics.with_stiffness(factor)
        return replace(scene, mechanics=replace(mechanics, has_region=region or mechanics.has_region))

    return Drawn(parameters, change, where or {})


def _log_ratio(random: Random, size: float) -> float:
    """Return the logarithm of a ratio of moduli: stiffer or softer, about twofold at the usual size."""
    return drawn_sign(random) * 0.7 * size


def _centre(random: Random) -> FloatArray:
    return np.array([random.uniform(-0.03, 0.012), random.uniform(-0.028, 0.028), 0.0])


def _blob(random: Random, size: float, base: Mechanics) -> Drawn:
    """A lobe without an edge: the logarithm of the modulus is a Gaussian of the place."""
    centre, width, ratio = _centre(random), float(random.uniform(0.006, 0.014)), _log_ratio(random, size)

    def factor(points: FloatArray) -> FloatArray:
        away = (points - centre)[:, :2]
        return np.exp(ratio * np.exp(-(away**2).sum(axis=1) / (2 * width**2)))

    parameters: dict[str, object] = {"shape": "Gaussian", "width": width, "log_ratio": ratio}
    return _stiffness(parameters, factor, {"centre": centre.tolist(), "radius": 1.5 * width}, region=True)


def _ellipse(random: Random, size: float, base: Mechanics) -> Drawn:
    centre, angle, ratio = _centre(random), float(random.uniform(0, np.pi)), _log_ratio(random, size)
    axes = np.array([random.uniform(0.012, 0.02), random.uniform(0.005, 0.009)])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

    def factor(points: FloatArray) -> FloatArray:
        away = (points - centre)[:, :2] @ turn.T / axes
        return np.where((away**2).sum(axis=1) < 1, np.exp(ratio), 1.0)

    parameters: dict[str, object] = {
        "shape": "ellipse",
        "half_axes": axes.tolist(),
        "angle": angle,
        "log_ratio": ratio,
    }
    return _stiffness(
        parameters, factor, {"centre": centre.tolist(), "radius": float(axes.mean())}, region=True
    )


def _two(random: Random, size: float, base: Mechanics) -> Drawn:
    centres = [_centre(random), _centre(random)]
    radii = [float(random.uniform(0.006, 0.011)) for _ in centres]
    ratios = [_log_ratio(random, size) for _ in centres]

    def factor(points: FloatArray) -> FloatArray:
        found = np.ones(len(points))
        for centre, radius, ratio in zip(centres, radii, ratios, strict=True):
            found = np.where(np.linalg.norm((points - centre)[:, :2], axis=1) < radius, np.exp(ratio), found)
        return found

    parameters: dict[str, object] = {
        "shape": "two cylinders",
        "centres": [centre.tolist() for centre in centres],
        "radii": radii,
        "log_ratios": ratios,
    }
    return _stiffness(parameters, factor, {}, region=True)


def _band(random: Random, size: float, base: Mechanics) -> Drawn:
    """A septum or a seam right across the body."""
    angle, ratio = float(random.uniform(0, np.pi)), _log_ratio(random, size)
    at, half = float(random.uniform(-0.025, 0.01)), float(random.uniform(0.003, 0.008))
    normal = np.array([np.cos(angle), np.sin(angle), 0.0])

    def factor(points: FloatArray) -> FloatArray:
        return np.where(np.abs(points @ normal - at) < half, np.exp(ratio), 1.0)

    parameters: dict[str, object] = {
        "shape": "band",
        "angle": angle,
        "at": at,
        "half_width": half,
        "log_ratio": ratio,
    }
    return _stiffness(parameters, factor, {}, region=True)


def _layer(random: Random, size: float, base: Mechanics) -> Drawn:
    """A capsule: the upper or the lower half, of another modulus, with a sharp boundary in the middle plane."""
    side, ratio = drawn_sign(random), _log_ratio(random, size)
    parameters: dict[str, object] = {
        "shape": "layer",
        "half": "upper" if side > 0 else "lower",
        "log_ratio": ratio,
    }
    return _stiffness(parameters, lambda points: np.where(side * points[:, 2] > 0, np.exp(ratio), 1.0))


def _vessel(random: Random, size: float, base: Mechanics) -> Drawn:
    """A stiff wall around a soft inside, upright."""
    centre, radius = _centre(random), float(random.uniform(0.008, 0.014))
    wall, ratio = float(random.uniform(0.002, 0.004)), 1.2 * size

    def factor(points: FloatArray) -> FloatArray:
        away = np.linalg.norm((points - centre)[:, :2], axis=1)
        return np.where(away < radius - wall, np.exp(-ratio), np.where(away < radius, np.exp(ratio), 1.0))

    parameters: dict[str, object] = {"shape": "vessel", "radius": radius, "wall": wall, "log_ratio": ratio}
    edges = [tuple(Break(float(c + side * radius), 0.002) for side in (-1, 1)) for c in centre[:2]]
    drawn = _stiffness(parameters, factor, {"centre": centre.tolist(), "radius": radius}, region=True)

    def change(scene: Scene) -> Scene:
        scene = drawn.change(scene)
        return replace(scene, mechanics=scene.mechanics.with_breaks(*edges))

    return replace(drawn, change=change)


def _random_field(random: Random, size: float, base: Mechanics) -> Drawn:
    """A log-normal field of a correlation length, drawn by waves (Shinozuka and Deodatis 1991)."""
    length, std = float(random.uniform(0.008, 0.02)), 0.3 * size
    vectors = random.standard_normal((_WAVES, 2)) / length
    phases = random.uniform(0, 2 * np.pi, _WAVES)

    def factor(points: FloatArray) -> FloatArray:
        waves = np.cos(points[:, :2] @ vectors.T + phases).sum(axis=1)
        return np.exp(std * np.sqrt(2 / _WAVES) * waves)

    parameters: dict[str, object] = {"shape": "random field", "correlation_length": length, "log_std": std}
    return _stiffness(parameters, factor, {}, region=True)


def _course(
    name: str, axes: tuple[int, ...], course: Callable[[FloatArray, float], FloatArray], scale: float
) -> Draw:
    """The logarithm of the modulus along a direction: a course of the place from −½ to ½, with a parameter in 0…1."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        log_change, form = drawn_sign(random) * scale * size, float(random.uniform(0, 1))
        angle = float(random.uniform(0, 2 * np.pi))
        direction = np.zeros(3)
        direction[list(axes)] = 1.0 if len(axes) == 1 else np.array([np.cos(angle), np.sin(angle)])
        along = direction / np.array(SIZE)

        def factor(points: FloatArray) -> FloatArray:
            return np.exp(log_change * course(np.clip(points @ along, -0.75, 0.75), form))

        parameters: dict[str, object] = {
            "course": name,
            "direction": direction.tolist(),
            "log_change": log_change,
            "parameter": form,
        }
        return _stiffness(parameters, factor)

    return draw


def _sigmoid(place: FloatArray, form: float) -> FloatArray:
    return np.tanh((place - 0.4 * (form - 0.5)) / 0.12) / 2


def _crust(place: FloatArray, form: float) -> FloatArray:
    """Dried from above: it falls off within a sixth to a half of the thickness."""
    return np.exp(-(0.5 - place) / (0.15 + 0.35 * form))


def _from_anchor(place: FloatArray, form: float) -> FloatArray:
    return np.exp(-(place + 0.5) / (0.1 + 0.3 * form))


def _radial(random: Random, size: float, base: Mechanics) -> Drawn:
    """Cured from the outside in: it changes with the distance from a point."""
    centre, log_change = _centre(random), drawn_sign(random) * 0.5 * size

    def factor(points: FloatArray) -> FloatArray:
        return np.exp(log_change * np.linalg.norm((points - centre)[:, :2], axis=1) / 0.05)

    parameters: dict[str, object] = {
        "course": "radial",
        "centre": centre.tolist(),
        "log_change_per_50_mm": log_change,
    }
    return _stiffness(parameters, factor)


FORMS: dict[str, tuple[Form, ...]] = {
    "inhomogeneity": (
        Form("gaussian", _blob, (0.02, 4.0), family="near"),
        Form("band", _band, (0.02, 3.0), family="far"),
        Form("ellipse", _ellipse, (0.02, 4.0), family="near"),
        Form("two_places", _two, (0.02, 4.0), family="far"),
        Form("vessel", _vessel, (0.02, 2.5), family="far"),
        Form("random_field", _random_field, (0.02, 3.5), family="far"),
    ),
    "modulus_gradient": (
        Form("oblique", _course("linear", (0, 1), lambda s, form: s, 0.4), (0.02, 4.0), family="exact"),
        Form("sigmoid", _course("sigmoid", (0, 1), _sigmoid, 0.4), (0.02, 4.0), family="near"),
        Form(
            "parabolic",
            _course("parabolic", (0, 1), lambda s, form: 4 * s**2, 0.4),
            (0.02, 4.0),
            family="near",
        ),
        Form("from_the_anchor", _course("exponential", (0,), _from_anchor, 0.5), (0.02, 4.0), family="near"),
        Form("crust", _course("crust", (2,), _crust, 0.6), (0.05, 3.0), family="near"),
        Form("layer", _layer, (0.05, 2.5), family="near"),
        Form("radial", _radial, (0.02, 4.0), family="far"),
    ),
}
