"""The gripper loses motion where its direction reverses."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Amplitude, Constant, Effect, Motion, Values
from estimator.effects.shared.history import settled

FloatArray = NDArray[np.float64]
Moving = Literal["translation", "rotation"]
AtRest = Literal["taken_up", "centred", "anywhere"]

# Motions below these are taken for noise: that of the reported position, and a turn of 1 mrad.
_NOISE_STDS = 5.0
_NO_TURN = 1e-3

_WIDTH = {
    "translation": Amplitude("width", "m", scale=4e-4, smallest=5e-5, lower=0.0),
    "rotation": Amplitude("width", "rad", scale=0.01, smallest=1e-3, lower=0.0),
}
# Where in the play the gripper rests, as a share of half its width: 1 taken up in the direction of the first motion.
_STARTS = {"taken_up": 1.0, "centred": 0.0}
_START = Constant("start", "1", (-0.5, 0.5), lower=-1.0, upper=1.0)


class RobotBacklash(Effect):
    """The gripper is dragged on a play of the given width: the play operator of hysteresis, in three dimensions.

    y follows x only where it would fall behind by more than r = width/2, and then along x − y (Visintin 1994,
    Differential Models of Hysteresis; here with a round characteristic). The true position is x − r (n − s n₁) with
    n = (x − y)/r, n₁ the direction of the first motion and s where the gripper rested: 0 with the play centred, 1 with
    it taken up, so that nothing is lost before the first reversal. A play narrower than the noise of x is that of noise
    width, scaled.
    """

    label = "robot_backlash"
    group = "robot"
    stage = "motion"
    acts_on = ("motion",)
    words = "The gripper loses some motion wherever its direction reverses."

    def __init__(self, moving: Moving, at_rest: AtRest) -> None:
        self.form = f"{moving}_{at_rest}"
        self.amplitudes = (_WIDTH[moving],)
        self._moving = moving
        self._at_rest = at_rest
        if at_rest == "anywhere":
            self.constants = (_START,)
            self.elaborates = f"{moving}_centred"

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Let the gripper follow with play."""
        half_width = 0.5 * values["width"]
        start = values[_START.name] if self._at_rest == "anywhere" else _STARTS[self._at_rest]
        if self._moving == "translation":
            noise = _NOISE_STDS * motion.experiment.sensor.position_std
            return motion.moved(motion.position - _lost(settled(motion), half_width, noise, start))
        lost = _lost(motion.rotation.as_rotvec(), half_width, _NO_TURN, start)
        return motion.moved(motion.position, Rotation.from_rotvec(-lost) * motion.rotation)


class AxisBacklash(RobotBacklash):
    """Each axis of the tissue frame has a play of its own, of the same width, in which it rests anywhere.

    One that moves little loses as much as one that moves far.
    """

    def __init__(self) -> None:
        super().__init__("translation", "anywhere")
        self.form = "by_axis"
        self.elaborates = "translation_taken_up"

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Let each axis follow with play."""
        half_width, start = 0.5 * values["width"], values[_START.name]
        noise = _NOISE_STDS * motion.experiment.sensor.position_std
        path = settled(motion)
        lost = [_lost(path[:, [axis]], half_width, noise, start) for axis in range(3)]
        return motion.moved(motion.position - np.hstack(lost))


def _lost(path: FloatArray, half_width: float, noise: float, start: float) -> FloatArray:
    """Return by how much (n, 3) what follows is behind the path (n, 3)."""
    radius = max(half_width, noise, 1e-12)
    at_rest = start * _first_direction(path, _leaning(path, radius, np.zeros(path.shape[1])))
    leaning = _leaning(path, radius, at_rest)
    return half_width * (leaning - at_rest)


def _leaning(path: FloatArray, radius: float, start: FloatArray) -> FloatArray:
    """Return n = (x − y)/r (n, 3) of the play operator, at most of length 1, from ``start`` (3,) on."""
    leaning = np.zeros_like(path)
    leaning[0] = start
    for row in range(1, len(path)):
        stretched = leaning[row - 1] + (path[row] - path[row - 1]) / radius
        leaning[row] = stretched / max(1.0, float(np.linalg.norm(stretched)))
    return leaning


def _first_direction(path: FloatArray, leaning: FloatArray) -> FloatArray:
    """Return the direction in which a path first takes up its play; zero where it never does."""
    length = np.linalg.norm(leaning, axis=1)
    if not np.any(length > 1.0 - 1e-9):
        return np.zeros(path.shape[1])
    return np.asarray(leaning[int(np.argmax(length > 1.0 - 1e-9))])
