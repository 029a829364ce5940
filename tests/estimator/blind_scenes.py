"""Short retractions on a very coarse mesh, on which the physics of an effect shows in a second."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.blind.making.mechanics.laws import Law
from estimator.blind.making.scenes.retraction import GRIPPER_AT_REST, KINDS, Rows
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics, Readings, Scene
from estimator.blind.making.scenes.simulate import TRIAL, carry_out, read
from estimator.experiment.model import TrajectoryKind

FloatArray = NDArray[np.float64]

COARSE = TRIAL
BASELINE = Mechanics(Law(15e3, 0.43))
BEADS = np.array([[x, y, 0.005] for y in (-0.03, -0.01, 0.01, 0.03) for x in (-0.03, -0.01, 0.01, 0.03)])
# Rows of a short experiment: at rest, half way, all the way, after a hold, half way back.
REST, HALF, FULL, HELD, BACK = range(5)
TRAVEL_M = 0.02


def short(kind: TrajectoryKind, order: int, turn: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Rows:
    """A pull in two rows of half a second, a hold of ten seconds, and half the way back."""
    done = np.array([0.0, 0.5, 1.0, 1.0, 0.5])
    return Rows(
        kind,
        order,
        np.array([0.0, 0.5, 1.0, 11.0, 11.5]),
        ("hold", "ramp", "ramp", "hold", "return"),
        np.array([0, 1, 1, 1, 2]),
        GRIPPER_AT_REST + np.outer(done * TRAVEL_M, [1.0, 0.0, 0.0]),
        Rotation.from_rotvec(np.outer(done, turn)),
    )


PULL = (short("pull", 1),)
# Later than a first experiment, and turning about two axes: every effect on the mechanics shows in it.
OBLIQUE = (short("twist_and_pull", 2, (0.4, 0.0, 0.3)),)
THREE = (
    short(KINDS[0], 1),
    short(KINDS[1], 2, (0.0, 0.0, 0.3)),
    short(KINDS[2], 3, (0.4, 0.0, 0.0)),
)


# Experiments compare by identity: each of the three is carried out once.
_UNDISTURBED = {
    PULL: cache(lambda: carry_out(BASELINE, PULL, BEADS, COARSE)),
    OBLIQUE: cache(lambda: carry_out(BASELINE, OBLIQUE, BEADS, COARSE)),
    THREE: cache(lambda: carry_out(BASELINE, THREE, BEADS, COARSE)),
}


@dataclass(frozen=True)
class Seen:
    """Readings of some experiments, free of noise."""

    readings: tuple[Readings, ...]

    @property
    def fx(self) -> FloatArray:
        """Force along x in the first experiment."""
        return self.readings[0].wrench[:, 0]

    @property
    def shifts(self) -> FloatArray:
        """Bead positions less their stated rest in the first experiment."""
        return self.readings[0].beads - BEADS


def see(scene: Scene, experiments: tuple[Rows, ...] = PULL) -> Seen:
    """Carry a scene out on the coarse mesh; instruments alone change nothing of the mechanics."""
    if scene.mechanics is BASELINE:
        return Seen(read(scene, _UNDISTURBED[experiments]()))
    return Seen(read(scene, carry_out(scene.mechanics, experiments, BEADS, COARSE)))


def baseline(experiments: tuple[Rows, ...] = PULL) -> Seen:
    """The scene without any effect."""
    return see(Scene(BASELINE), experiments)


def drawn(form: Form, size: float = 1.0, seed: int = 3) -> Drawn:
    """Draw a form of an effect for the baseline."""
    return form.draw(np.random.default_rng(seed), size, BASELINE)


def with_effect(form: Form, size: float = 1.0, experiments: tuple[Rows, ...] = PULL) -> Seen:
    """See the baseline with one effect."""
    return see(drawn(form, size).change(Scene(BASELINE)), experiments)
