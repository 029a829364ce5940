"""Relaxation, softening and set by the laws in use for rubber and soft tissue."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import nnls
from scipy.special import erf, exp1

from estimator.blind.making.effects.drawing import Draw, FloatArray, Random, acted_as, drawn_between
from estimator.blind.making.mechanics.response import PermanentSet, Relaxation, Softening
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics

# Maxwell elements by which a course of relaxation is drawn, and the times at which it is to agree, s.
_ELEMENTS_S = np.geomspace(0.05, 3000.0, 14)
_AGREES_S = np.geomspace(0.02, 2000.0, 200)


def elements_of(course: Callable[[FloatArray], FloatArray]) -> Relaxation:
    """Return Maxwell elements whose sum follows a course that falls from 1 to 0, of times (n,) s."""
    kernels = np.exp(-_AGREES_S[:, None] / _ELEMENTS_S)
    shares, _ = nnls(kernels, course(_AGREES_S))
    used = shares > 1e-6
    return Relaxation(tuple(shares[used].tolist()), tuple(_ELEMENTS_S[used].tolist()))


def _relaxing(parameters: dict[str, object], unit: Relaxation, relaxed: float, base: Mechanics) -> Drawn:
    """Return relaxation by a share of the sudden stress; the stated modulus is that of a slow stretch."""
    scale = relaxed / (1 - relaxed)
    relaxation = replace(unit, shares=tuple(scale * share for share in unit.shares))
    stated = {"relaxed_fraction": relaxed, "youngs_modulus_is": "long-term (relaxed)"}
    return acted_as({**parameters, **stated}, relaxation=relaxation)


def _relaxed(size: float) -> float:
    return min(0.2 * size, 0.7)


def _power_law(random: Random, size: float, base: Mechanics) -> Drawn:
    """(1 + t/τ)^−β (Nutting 1921; of tissue as in Kobayashi et al. 2012)."""
    exponent, onset = float(random.uniform(0.15, 0.6)), drawn_between(random, 0.2, 3.0)
    parameters: dict[str, object] = {"kind": "power law", "exponent": exponent, "onset_s": onset}
    return _relaxing(parameters, elements_of(lambda t: (1 + t / onset) ** -exponent), _relaxed(size), base)


def _stretched(random: Random, size: float, base: Mechanics) -> Drawn:
    """exp(−(t/τ)^β) (Kohlrausch 1854; Williams and Watts 1970)."""
    exponent, time = float(random.uniform(0.3, 0.75)), drawn_between(random, 2.0, 30.0)
    parameters: dict[str, object] = {
        "kind": "stretched exponential",
        "exponent": exponent,
        "time_constant": time,
    }
    return _relaxing(
        parameters, elements_of(lambda t: np.exp(-((t / time) ** exponent))), _relaxed(size), base
    )


def _box_spectrum(random: Random, size: float, base: Mechanics) -> Drawn:
    """(E1(t/τ2) − E1(t/τ1)) / ln(τ2/τ1): quasi-linear viscoelasticity (Fung 1972)."""
    shortest, longest = drawn_between(random, 0.1, 1.0), drawn_between(random, 30.0, 400.0)

    def course(t: FloatArray) -> FloatArray:
        return np.asarray((exp1(t / longest) - exp1(t / shortest)) / np.log(longest / shortest))

    parameters: dict[str, object] = {"kind": "box spectrum", "shortest_s": shortest, "longest_s": longest}
    return _relaxing(parameters, elements_of(course), _relaxed(size), base)


def _several_times(times_s: Sequence[tuple[float, float]]) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        times = tuple(drawn_between(random, *limits) for limits in times_s)
        shares = tuple(map(float, random.dirichlet(np.full(len(times), 3.0))))
        parameters: dict[str, object] = {
            "kind": "several times",
            "time_constant": list(times),
            "share": list(shares),
        }
        return _relaxing(parameters, Relaxation(shares, times), _relaxed(size), base)

    return draw


def _nonlinear(random: Random, size: float, base: Mechanics) -> Drawn:
    """Large strains relax by a larger share (Pipkin and Rogers 1968)."""
    time = drawn_between(random, 2.0, 20.0)
    scale = base.law.youngs_modulus * drawn_between(random, 0.003, 0.02)
    relaxed = min(0.08 * size, 0.5)
    parameters: dict[str, object] = {"kind": "nonlinear", "time_constant": time, "energy_scale": scale}
    return _relaxing(parameters, Relaxation((1.0,), (time,), scale), relaxed, base)


def _scale(random: Random, base: Mechanics) -> float:
    """An energy density that the tissue near the grasp passes in the first retraction, J/m³."""
    return base.law.youngs_modulus * drawn_between(random, 0.003, 0.03)


def _softening(parameters: dict[str, object], softening: Softening, mended: float = 0.0) -> Drawn:
    return acted_as(parameters, softening=softening, mended=mended)


def pseudo_elastic_by_erf(strength: float, scale: float, relative: float) -> Softening:
    """1 − strength·erf((peak − W)/(scale + relative·peak)) (Ogden and Roxburgh 1999; the width of Abaqus)."""

    def factor(energy: FloatArray, peak: FloatArray) -> tuple[FloatArray, FloatArray]:
        width = scale + relative * peak
        z = np.maximum(peak - energy, 0.0) / width
        slope = np.where(peak > energy, strength * 2 / np.sqrt(np.pi) * np.exp(-(z**2)) / width, 0.0)
        return 1 - strength * erf(z), slope

    return factor


def exponential_of_strain(rate: float, modulus: float) -> Softening:
    """exp(−b √(M − m)), M and m measures of the largest and the present strain (Elías-Zúñiga and Beatty 2002)."""

    def factor(energy: FloatArray, peak: FloatArray) -> tuple[FloatArray, FloatArray]:
        # √(2 W/E) is about the strain.
        largest, present = (np.sqrt(2 * np.maximum(w, 1e-9 * modulus) / modulus) for w in (peak, energy))
        # Rounded where the two meet, so that the derivative stays finite.
        apart = np.maximum(largest - present, 0.0)
        rounded = np.sqrt(apart + 1e-4) - 1e-2
        left = np.exp(-rate * rounded)
        by_present = rate * left / (2 * np.sqrt(apart + 1e-4))
        slope = np.where(peak > energy, by_present / (modulus * present), 0.0)
        return left, slope

    return factor


def damage_beyond(strength: float, scale: float, threshold: float) -> Softening:
    """1 − strength·(1 − exp(−⟨peak − W₀⟩/scale)): nothing is damaged below a threshold (Lemaitre 1985)."""

    def factor(energy: FloatArray, peak: FloatArray) -> tuple[FloatArray, FloatArray]:
        left = np.exp(-np.maximum(peak - threshold, 0.0) / scale)
        slope = np.where((energy >= peak) & (peak > threshold), -strength * left / scale, 0.0)
        return 1 - strength * (1 - left), slope

    return factor


def _ogden_roxburgh(random: Random, size: float, base: Mechanics) -> Drawn:
    strength, scale = min(0.25 * size, 0.8), _scale(random, base)
    relative = float(random.uniform(0.0, 0.3))
    parameters: dict[str, object] = {
        "kind": "Ogden-Roxburgh",
        "r": 1 / strength,
        "m": scale,
        "beta": relative,
    }
    return _softening(parameters, pseudo_elastic_by_erf(strength, scale, relative))


def _exponential(random: Random, size: float, base: Mechanics) -> Drawn:
    rate = 1.2 * size
    parameters: dict[str, object] = {"kind": "exponential of the strain", "rate": rate}
    return _softening(parameters, exponential_of_strain(rate, base.law.youngs_modulus))


def _threshold(random: Random, size: float, base: Mechanics) -> Drawn:
    strength, scale = min(0.35 * size, 0.8), _scale(random, base)
    threshold = base.law.youngs_modulus * drawn_between(random, 0.002, 0.01)
    parameters: dict[str, object] = {
        "kind": "damage beyond a threshold",
        "strength": strength,
        "energy_scale": scale,
        "threshold": threshold,
    }
    return _softening(parameters, damage_beyond(strength, scale, threshold))


def _mending(random: Random, size: float, base: Mechanics) -> Drawn:
    strength, scale = min(0.25 * size, 0.8), _scale(random, base)
    mended = float(random.uniform(0.4, 1.0))
    parameters: dict[str, object] = {
        "kind": "Ogden-Roxburgh, mends between experiments",
        "strength": strength,
        "energy_scale": scale,
        "mended": mended,
    }
    return _softening(parameters, pseudo_elastic_by_erf(strength, scale, 0.0), mended)


def _set(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        share, mended, law = min(0.06 * size, 0.4), 0.0, PermanentSet(0.0)
        if kind == "yielding":
            law = PermanentSet(min(2 * share, 0.5), yields_at=float(random.uniform(0.05, 0.15)))
        elif kind == "growing":
            law = PermanentSet(share / 2, per_strain=float(random.uniform(3.0, 8.0)))
        else:
            law, mended = (
                PermanentSet(share, drawn_between(random, 2.0, 20.0)),
                float(random.uniform(0.4, 0.9)),
            )
        parameters: dict[str, object] = {
            "kind": kind,
            "share_of_largest_strain": law.share,
            "yields_at_strain": law.yields_at,
            "growth_per_strain": law.per_strain,
            "time_constant": law.time,
            "mended_between_experiments": mended,
        }
        return acted_as(parameters, permanent_set=law, mended=mended)

    return draw


FORMS: dict[str, tuple[Form, ...]] = {
    "viscoelasticity": (
        Form("power_law", _power_law, (0.05, 3.5), family="near"),
        Form("nonlinear", _nonlinear, (0.02, 6.0), family="far"),
        Form("stretched_exponential", _stretched, (0.05, 3.5), family="near"),
        Form("box_spectrum", _box_spectrum, (0.05, 3.5), family="near"),
        Form("two_times", _several_times([(0.5, 4.0), (15.0, 80.0)]), (0.05, 3.5), family="exact"),
        Form(
            "three_times",
            _several_times([(0.4, 2.0), (5.0, 15.0), (50.0, 200.0)]),
            (0.05, 3.5),
            family="near",
        ),
    ),
    "stress_softening": (
        Form("ogden_roxburgh", _ogden_roxburgh, (0.05, 3.2), family="exact"),
        Form("exponential_of_strain", _exponential, (0.02, 4.0), family="near"),
        Form("mending", _mending, (0.05, 3.2), family="far"),
        Form("damage_beyond_a_threshold", _threshold, (0.05, 2.3), family="near"),
    ),
    "permanent_set": (
        Form("yielding", _set("yielding"), (0.02, 6.0), family="near"),
        Form("growing_with_strain", _set("growing"), (0.02, 5.0), family="near"),
        Form("mending", _set("mending"), (0.02, 6.0), family="far"),
    ),
}
