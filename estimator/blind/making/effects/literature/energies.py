"""Stiffening, the second invariant and fibres, by the laws of rubber and of soft tissue.

Sizes: 1 is what gap tables call typical; the formulas' sources are in ``mechanics.energies`` and ``mechanics.laws``.
"""

from dataclasses import replace

import numpy as np

from estimator.blind.making.effects.drawing import Draw, Random, drawn_between, drawn_sign
from estimator.blind.making.mechanics.energies import (
    Stretches,
    TransverselyIsotropic,
    both_ways,
    fading,
    hardening,
    power_of_invariant,
    recruited,
    root,
)
from estimator.blind.making.mechanics.laws import (
    Addition,
    Curve,
    Fibres,
    Term,
    limited,
    logarithmic,
    power,
    tension_only,
)
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics


def _by_terms(parameters: dict[str, object], *terms: Term) -> Drawn:
    return Drawn(parameters, lambda scene: replace(scene, mechanics=scene.mechanics.with_terms(*terms)))


def _by_addition(parameters: dict[str, object], addition: Addition) -> Drawn:
    return Drawn(parameters, lambda scene: replace(scene, mechanics=scene.mechanics.with_additions(addition)))


def _by_fibres(parameters: dict[str, object], *fibres: Fibres) -> Drawn:
    return Drawn(parameters, lambda scene: replace(scene, mechanics=scene.mechanics.with_fibres(*fibres)))


def _yeoh_cubic(random: Random, size: float, base: Mechanics) -> Drawn:
    third = 0.25 * size
    return _by_terms({"law": "yeoh, cubic term", "C3_over_C1": third}, Term("isochoric_1", power(3), third))


def _lopez_pamies(random: Random, size: float, base: Mechanics) -> Drawn:
    exponent = 1 + 1.2 * size
    term = Term("isochoric_1", power_of_invariant(exponent))
    return _by_terms({"law": "Lopez-Pamies", "exponent": exponent}, term)


def _knowles(random: Random, size: float, base: Mechanics) -> Drawn:
    exponent, rate = float(random.uniform(1.4, 4.0)), 1.2 * size
    term = Term("coupled_1", hardening(rate, exponent))
    return _by_terms({"law": "Knowles", "exponent": exponent, "rate": rate}, term)


def _pucci_saccomandi(random: Random, size: float, base: Mechanics) -> Drawn:
    limit, share = 3.0 / size, float(random.uniform(0.05, 0.2))
    terms = (
        Term("isochoric_1", limited(limit)),
        Term("isochoric_2", logarithmic(), share),
        Term("isochoric_1", power(1), -share),
    )
    return _by_terms({"law": "Pucci-Saccomandi", "Jm": limit, "share_of_logarithm": share}, *terms)


def _toe(random: Random, size: float, base: Mechanics) -> Drawn:
    beyond, weight = float(random.uniform(0.03, 0.12)), 1.5 * size
    parameters: dict[str, object] = {
        "law": "recruited beyond a toe",
        "from_I1_minus_3": beyond,
        "weight": weight,
    }
    return _by_terms(parameters, Term("isochoric_1", recruited(beyond), weight))


def _ogden(two: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        share = 0.3 * size
        exponents = [float(random.uniform(5.0, 10.0))]
        weights = [min(share, 2.0)]
        if two:
            exponents.append(float(random.uniform(-8.0, -4.0)))
            weights.append(min(share * float(random.uniform(0.3, 1.0)), 2.0))
        parameters: dict[str, object] = {"law": "Ogden", "exponents": exponents, "weights": weights}
        return _by_addition(parameters, Stretches(tuple(exponents), tuple(weights)))

    return draw


def _ogden_negative(random: Random, size: float, base: Mechanics) -> Drawn:
    exponent, share = float(random.uniform(-4.0, -1.0)), 0.35 * size
    parameters: dict[str, object] = {"law": "Ogden", "exponents": [exponent], "weights": [share]}
    return _by_addition(parameters, Stretches((exponent,), (share,)))


def _second(name: str) -> Draw:
    """A share of the energy that follows a curve of the second invariant, in place of the first."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        share = 0.35 * size
        range_ = float(random.uniform(0.3, 1.2))
        curve: Curve = root() if name == "Carroll" else fading(range_)
        terms = [Term("isochoric_2", curve, share), Term("isochoric_1", power(1), -share)]
        return _by_terms({"law": name, "share": share, "range": range_}, *terms)

    return draw


def _biderman(random: Random, size: float, base: Mechanics) -> Drawn:
    share, square = 0.3 * size, 0.15 * size * float(random.uniform(0.5, 1.5))
    terms = (
        Term("isochoric_2", power(1), share),
        Term("isochoric_1", power(1), -share),
        Term("isochoric_2", power(2), square),
    )
    parameters: dict[str, object] = {
        "law": "second invariant and its square",
        "share": share,
        "square": square,
    }
    return _by_terms(parameters, *terms)


def _angle(random: Random) -> float:
    return float(random.uniform(-np.pi / 2, np.pi / 2))


def _in_plane(angle: float) -> tuple[float, float, float]:
    return (float(np.cos(angle)), float(np.sin(angle)), 0.0)


def _dispersed(random: Random, size: float, base: Mechanics) -> Drawn:
    angle, dispersion = _angle(random), float(random.uniform(0.05, 0.25))
    rate, weight = float(random.uniform(0.2, 1.0)), 0.5 * size
    parameters: dict[str, object] = {
        "kind": "dispersed, tension only",
        "angle_from_x": angle,
        "dispersion": dispersion,
        "added_modulus_ratio": weight,
    }
    return _by_fibres(parameters, Fibres(_in_plane(angle), tension_only(rate), weight, dispersion))


def _both_ways(random: Random, size: float, base: Mechanics) -> Drawn:
    angle, rate, weight = _angle(random), drawn_between(random, 0.5, 4.0), 0.3 * size
    parameters: dict[str, object] = {
        "kind": "exponential",
        "angle_from_x": angle,
        "rate": rate,
        "weight": weight,
    }
    return _by_fibres(parameters, Fibres(_in_plane(angle), both_ways(rate), weight))


def _two_families(random: Random, size: float, base: Mechanics) -> Drawn:
    middle, half = _angle(random), float(random.uniform(0.35, 1.2))
    weight, uneven = 0.3 * size, float(random.uniform(0.5, 1.0))
    rate = float(random.uniform(0.2, 1.0))
    parameters: dict[str, object] = {
        "kind": "two families, tension only",
        "mean_angle_from_x": middle,
        "half_angle_between": half,
        "weights": [weight, uneven * weight],
    }
    pair = [(middle - half, weight), (middle + half, uneven * weight)]
    return _by_fibres(parameters, *(Fibres(_in_plane(a), tension_only(rate), w) for a, w in pair))


def _out_of_plane(random: Random, size: float, base: Mechanics) -> Drawn:
    angle, tilt, weight = _angle(random), drawn_sign(random) * float(random.uniform(0.4, 1.2)), 0.3 * size
    direction = (
        float(np.cos(angle) * np.cos(tilt)),
        float(np.sin(angle) * np.cos(tilt)),
        float(np.sin(tilt)),
    )
    parameters: dict[str, object] = {
        "kind": "tilted out of the plane",
        "direction": list(direction),
        "weight": weight,
    }
    return _by_fibres(parameters, Fibres(direction, power(2), weight))


def _transversely_isotropic(random: Random, size: float, base: Mechanics) -> Drawn:
    angle = _angle(random)
    along, shear = 1.0 * size, 0.35 * size * float(random.uniform(0.3, 1.0))
    coupled = 0.2 * size * float(random.uniform(-0.5, 1.0))
    parameters: dict[str, object] = {
        "kind": "transversely isotropic at small strain",
        "angle_from_x": angle,
        "along_over_shear_modulus": along,
        "shear_over_shear_modulus": shear,
        "coupled_over_shear_modulus": coupled,
    }
    return _by_addition(parameters, TransverselyIsotropic(_in_plane(angle), along, coupled, shear))


FORMS: dict[str, tuple[Form, ...]] = {
    "strain_stiffening": (
        Form("yeoh_cubic", _yeoh_cubic, (0.02, 20.0), family="near"),
        Form("ogden_two_powers", _ogden(two=True), (0.02, 5.0), family="far"),
        Form("lopez_pamies", _lopez_pamies, (0.02, 4.0), family="near"),
        Form("recruited_beyond_a_toe", _toe, (0.02, 20.0), family="far"),
        Form("knowles", _knowles, (0.02, 8.0), family="near"),
        Form("ogden", _ogden(two=False), (0.02, 5.0), family="near"),
        Form("pucci_saccomandi", _pucci_saccomandi, (0.05, 3.0), family="near"),
    ),
    "second_invariant": (
        Form("ogden_of_a_negative_power", _ogden_negative, (0.05, 4.0), family="near"),
        Form("carroll", _second("Carroll"), (0.1, 2.6), family="near"),
        Form("biderman", _biderman, (0.05, 3.0), family="far"),
        Form("alexander", _second("Alexander"), (0.1, 2.6), family="near"),
    ),
    "anisotropy": (
        Form("two_families", _two_families, (0.02, 8.0), family="far"),
        Form("transversely_isotropic", _transversely_isotropic, (0.01, 4.0), family="far"),
        Form("dispersed", _dispersed, (0.02, 10.0), family="exact"),
        Form("out_of_plane", _out_of_plane, (0.02, 8.0), family="far"),
        Form("exponential_both_ways", _both_ways, (0.02, 6.0), family="near"),
    ),
}
