"""What every effect is drawn with."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.scenes.retraction import Rows
from estimator.blind.making.scenes.scene import Drawn, Mechanics, Reading

FloatArray = NDArray[np.float64]
Random = np.random.Generator
Draw = Callable[[Random, float, Mechanics], Drawn]


def drawn_sign(random: Random) -> float:
    """Return −1 or 1."""
    return float(random.choice([-1.0, 1.0]))


def drawn_direction(random: Random) -> FloatArray:
    """Return a unit vector (3,)."""
    vector = random.standard_normal(3)
    return vector / np.linalg.norm(vector)


def read_as(parameters: dict[str, object], reading: Reading) -> Drawn:
    """An effect of the instruments alone."""
    return Drawn(parameters, lambda scene: scene.read_by(reading))


def moved_as(parameters: dict[str, object], change: Callable[[Rows], Rows]) -> Drawn:
    """An effect of how the gripper moves alone."""
    return Drawn(parameters, lambda scene: replace(scene, mechanics=scene.mechanics.with_motion(change)))


def acted_as(parameters: dict[str, object], **changes: object) -> Drawn:
    """An effect that changes fields of the mechanics."""
    return Drawn(parameters, lambda scene: scene.acted_on(**changes))


def drawn_between(random: Random, low: float, high: float) -> float:
    """Return a number between two of one sign, uniform in its logarithm."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))
