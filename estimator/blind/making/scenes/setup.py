"""What a case is before any effect: a phantom, how it is held, where its beads are, and the order of experiments."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.laws import Law
from estimator.blind.making.scenes.noise import NOISE_KINDS, NoiseKind
from estimator.blind.making.scenes.retraction import KINDS, Manner, Rows, rows_of
from estimator.blind.making.scenes.scene import Form, Mechanics
from estimator.experiment import SensorNoise
from estimator.experiment.model import TrajectoryKind

FloatArray = NDArray[np.float64]

SENSOR = SensorNoise(
    force_std=0.02,
    torque_std=5e-4,
    fiducial_std=5e-5,
    position_std=3e-5,
    tool_mass=0.35,
    tool_centre=(0.0, 0.0, 0.06),
)

MODULUS_PA = (4e3, 30e3)
POISSON = (0.37, 0.48)
_GRID = (-0.03, -0.01, 0.01, 0.03)
_JITTER_M = 1.5e-3
_STRUCTURED_NOISE = 0.2
_TWO_SIDES = 0.3


@dataclass(frozen=True)
class Setup:
    """A case without effects.

    Attributes
    ----------
    mechanics : the baseline
    order : kinds of trajectory, in the order in which they are carried out
    manner : how they are carried out
    beads : (m, 3) stated rest positions, m
    noise : its structure
    phantom_id : of the experiments
    sensor : stated noise
    """

    mechanics: Mechanics
    order: tuple[TrajectoryKind, ...]
    manner: Manner
    beads: FloatArray
    noise: NoiseKind
    phantom_id: str
    sensor: SensorNoise = SENSOR

    @property
    def experiments(self) -> tuple[Rows, ...]:
        """Rows of the experiments in their order."""
        return tuple(rows_of(kind, place, self.manner) for place, kind in enumerate(self.order, start=1))


def draw_setup(random: np.random.Generator, forms: tuple[Form, ...]) -> Setup:
    """Draw a case that suits the forms of effects it is to have."""
    least = max((MODULUS_PA[0], *(form.least_modulus for form in forms)))
    modulus = float(np.exp(random.uniform(np.log(least), np.log(MODULUS_PA[1]))))
    poisson = float(random.uniform(*POISSON))
    two_sides = bool(random.random() < _TWO_SIDES) and all(form.two_sides for form in forms)
    order = tuple(KINDS[i] for i in random.permutation(len(KINDS)))
    manner = Manner()
    if random.random() < 0.5:
        manner = Manner(
            distance=round(float(random.uniform(0.017, 0.021)), 4),
            turn=round(float(random.uniform(0.8, 1.1)), 3),
            slowness=round(float(random.uniform(0.8, 1.3)), 1),
        )
    grid = np.array([[x, y, 0.005] for y in _GRID for x in _GRID])
    grid[:, :2] += np.clip(random.normal(0.0, 1e-3, (16, 2)), -2 * _JITTER_M, 2 * _JITTER_M)
    structured = random.random() < _STRUCTURED_NOISE
    noise = NOISE_KINDS[int(random.integers(1, len(NOISE_KINDS)))] if structured else NOISE_KINDS[0]
    return Setup(
        Mechanics(Law(modulus, poisson), two_sides=two_sides),
        order,
        manner,
        np.round(grid, 7),
        noise,
        f"P{int(random.integers(10, 100))}",
    )
