"""Further effects that no label of the catalogue means: the right answer to them is "unknown"."""

from dataclasses import replace

import numpy as np

from estimator.blind.making.effects.drawing import Draw, Random, acted_as, drawn_between, drawn_sign, read_as
from estimator.blind.making.effects.motion import play
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics, Readings


def _hysteresis(random: Random, size: float, base: Mechanics) -> Drawn:
    """The force sensor's own hysteresis: a play in what it reads."""
    width = 0.05 * size * base.law.youngs_modulus / 15e3 * np.array([1.0, 0.5, 0.5, 0.02, 0.02, 0.02])

    def change(reading: Readings) -> Readings:
        sensed = reading.sensed()
        columns = [play(c, w, 0.0) for c, w in zip(sensed.T, width, strict=True)]
        return reading.with_sensed(np.column_stack(columns))

    return read_as({"width": width.tolist()}, change)


def _coarse(random: Random, size: float, base: Mechanics) -> Drawn:
    """A converter that lost its lowest bits."""
    step = 0.12 * size * np.array([1.0, 1.0, 1.0, 0.03, 0.03, 0.03])

    def change(reading: Readings) -> Readings:
        return reading.with_sensed(np.round(reading.sensed() / step) * step)

    return read_as({"step": step.tolist()}, change)


def _hum(random: Random, size: float, base: Mechanics) -> Drawn:
    """Interference that is sampled once a row: it beats slowly."""
    period, phase = drawn_between(random, 5.0, 25.0), float(random.uniform(0, 2 * np.pi))
    error = 0.06 * size * np.array([1.0, 1.0, 1.0, 0.03, 0.03, 0.03]) * random.standard_normal(6)

    def change(reading: Readings) -> Readings:
        wave = np.sin(2 * np.pi * reading.rows.time / period + phase)
        return reading.with_sensed(reading.sensed() + np.outer(wave - wave[0], error))

    return read_as({"period": period, "amplitude": error.tolist()}, change)


def _obstacle(random: Random, size: float, base: Mechanics) -> Drawn:
    """The tool meets an obstacle beyond some travel."""
    onset, stiffness = float(random.uniform(0.008, 0.014)), 60.0 * size
    aside = np.array([-1.0, *random.uniform(-0.5, 0.5, 2)])
    arm = np.array([0.0, 0.0, float(random.uniform(0.02, 0.08))])

    def change(reading: Readings) -> Readings:
        pressed = stiffness * np.maximum(reading.rows.travel - onset, 0.0)
        force = np.outer(pressed, aside)
        torque = np.cross(np.broadcast_to(arm, force.shape), force)
        return replace(reading, wrench=reading.wrench + np.hstack([force, torque]))

    return read_as({"onset_travel": onset, "stiffness": stiffness}, change)


def _distorted(kind: str) -> Draw:
    """Lenses: a prism that was not calibrated away, or pixels that are not square to each other."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        strength, axis = drawn_sign(random) * size, int(random.integers(2))
        centre = np.array([*random.uniform(-0.03, 0.03, 2), 0.005])

        def change(reading: Readings) -> Readings:
            away, beads = reading.beads - centre, reading.beads.copy()
            radius2 = (away[..., :2] ** 2).sum(axis=-1)
            if kind == "prism":
                beads[..., axis] += 0.2 * strength * radius2
            else:
                beads[..., 2] += 0.4 * strength * radius2
            return replace(reading, beads=beads)

        return read_as({"kind": kind, "strength": strength, "centre": centre[:2].tolist()}, change)

    return draw


def _drying(random: Random, size: float, base: Mechanics) -> Drawn:
    """Tissue that dries shrinks while it is pulled: by the root of the time since it was mounted."""
    rate = 0.002 * size

    def swelling(instant_time: float, order: int) -> float:
        return 1 - rate * float(np.sqrt(instant_time / 60 + 2.0 * (order - 1)))

    return acted_as(
        {"linear_strain_per_root_minute": rate}, swelling=lambda now: swelling(now.time, now.order)
    )


_DRAWS: dict[str, tuple[Draw, tuple[float, float], str]] = {
    "force_hysteresis": (_hysteresis, (0.05, 6.0), "force"),
    "coarse_converter": (_coarse, (0.05, 5.0), "force"),
    "hum": (_hum, (0.02, 8.0), "force"),
    "obstacle": (_obstacle, (0.02, 10.0), "force"),
    "prism": (_distorted("prism"), (0.02, 8.0), "vision"),
    "curved_field": (_distorted("field"), (0.02, 8.0), "vision"),
    "drying": (_drying, (0.02, 5.0), "geometry"),
}

FORMS: dict[str, Form] = {
    name: Form(name, draw, limits, family="far", beads=int(block == "vision"), acts_on=block)
    for name, (draw, limits, block) in _DRAWS.items()
}
