"""Cases as other laboratories would have them: other bodies, beads, channels, speeds, holds and noise."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.laws import Law
from estimator.blind.making.scenes.noise import NOISE_KINDS
from estimator.blind.making.scenes.outline import Cylinder, Organ, Outline
from estimator.blind.making.scenes.parts import drawn_parts, stiffness_of
from estimator.blind.making.scenes.retraction import KINDS, Manner
from estimator.blind.making.scenes.scene import GRASP_Y, Form, Mechanics
from estimator.blind.making.scenes.setup import MODULUS_PA, POISSON, SENSOR, Setup
from estimator.experiment import SensorNoise

FloatArray = NDArray[np.float64]
T = TypeVar("T")

WITH_PARTS = "organ_with_parts"
"""An organ with a cavity and a region of another modulus, both stated."""

# How often each is drawn.
_BODIES = {"block": 0.8, "organ": 0.12, "cylinder": 0.08}
_BEADS = {6: 0.25, 16: 0.4, 60: 0.25, 0: 0.1}
_STRUCTURED_NOISE = 0.2
_TWO_SIDES = 0.4
# Of the usual standard deviations.
_NOISE = (0.2, 5.0)
_JITTER_M = 1e-3


def draw_wide_setup(random: np.random.Generator, forms: tuple[Form, ...], wanted: str = "") -> Setup:
    """Draw a case that suits the forms of effects it is to have.

    ``wanted`` is :data:`WITH_PARTS` for an organ with a cavity and a region, wherever the forms allow one; empty for
    any body.
    """
    least = max((MODULUS_PA[0], *(form.least_modulus for form in forms)))
    modulus = float(np.exp(random.uniform(np.log(least), np.log(MODULUS_PA[1]))))
    body = _drawn(random, _BODIES, lambda name: name == "block" or not any(form.block for form in forms))
    if wanted and not any(form.block for form in forms):
        body = wanted
    beads = _drawn(random, _BEADS, lambda count: all(count >= form.beads for form in forms))
    two_sides = bool(random.random() < _TWO_SIDES) and all(form.two_sides for form in forms)
    outline = _outline(body, random)
    parts = drawn_parts(random) if body == WITH_PARTS else ()
    mechanics = Mechanics(
        Law(modulus, float(random.uniform(*POISSON))),
        two_sides=two_sides and body != "cylinder",
        outline=outline,
        parts=parts,
        stiffness=(stiffness_of(parts, outline),) if parts and isinstance(outline, Organ) else (),
        beads=beads,
        grasp_y=(-0.05, 0.05) if body == "cylinder" else GRASP_Y,
    )
    manner = Manner(
        distance=round(float(random.uniform(0.014, 0.021)), 4),
        turn=round(float(random.uniform(0.6, 1.1)), 3),
        slowness=round(float(np.exp(random.uniform(np.log(0.4), np.log(3.0)))), 1),
        hold=round(float(np.exp(random.uniform(np.log(0.5), np.log(6.0)))), 1),
        long_hold=[(3.0, 5.0, 10.0), (2.0, 8.0, 20.0, 30.0), (5.0,)][int(random.integers(3))],
        steps=[1.0, 0.8, 0.5][int(random.integers(3))],
    )
    structured = random.random() < _STRUCTURED_NOISE
    return Setup(
        mechanics,
        tuple(KINDS[i] for i in random.permutation(len(KINDS))),
        manner,
        _beads(mechanics, random),
        NOISE_KINDS[int(random.integers(1, len(NOISE_KINDS)))] if structured else NOISE_KINDS[0],
        f"P{int(random.integers(10, 100))}",
        _noisier(float(np.exp(random.uniform(*np.log(_NOISE))))),
    )


def _drawn(random: np.random.Generator, weights: dict[T, float], suits: Callable[[T], bool]) -> T:
    """Return one of what suits, drawn by its weight."""
    known = [one for one in weights if suits(one)]
    share = np.array([weights[one] for one in known])
    return known[int(random.choice(len(known), p=share / share.sum()))]


def _outline(body: str, random: np.random.Generator) -> Outline | None:
    if body in ("organ", WITH_PARTS):
        return Organ(
            dome=float(random.uniform(0.004, 0.010)),
            hollow=float(random.uniform(0.0, 0.003)),
            taper=float(random.uniform(0.2, 0.6)),
        )
    return Cylinder(float(random.uniform(0.015, 0.022))) if body == "cylinder" else None


def _beads(mechanics: Mechanics, random: np.random.Generator) -> FloatArray:
    """Return rest positions (m, 3) on the upper face, m: a grid that nobody laid quite evenly."""
    rows, columns = {0: (0, 0), 6: (2, 3), 16: (4, 4), 60: (6, 10)}[mechanics.beads]
    width = mechanics.outline.radius * 0.6 if isinstance(mechanics.outline, Cylinder) else 0.03
    x, y = (centre * np.linspace(-1, 1, count) for centre, count in ((0.03, columns), (width, rows)))
    if isinstance(mechanics.outline, Cylinder):
        x = x - 0.008  # The jaws hold all around.
    places = np.array([[a, b] for b in y for a in x]).reshape(-1, 2)
    places += np.clip(random.normal(0.0, _JITTER_M, places.shape), -1.5 * _JITTER_M, 1.5 * _JITTER_M)
    outline = mechanics.outline
    top = outline.top(*places.T) if outline else np.full(len(places), mechanics.thickness / 2)
    return np.round(np.column_stack([places, top]), 7)


def _noisier(factor: float) -> SensorNoise:
    """Return the usual sensors with so many times their noise."""
    return replace(
        SENSOR,
        force_std=float(f"{SENSOR.force_std * factor:.3g}"),
        torque_std=float(f"{SENSOR.torque_std * factor:.3g}"),
        fiducial_std=float(f"{SENSOR.fiducial_std * factor:.3g}"),
        position_std=float(f"{SENSOR.position_std * factor:.3g}"),
    )
