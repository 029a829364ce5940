"""A joint of the robot jams: no label of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Motion, Readings, Values

FloatArray = NDArray[np.float64]

_LOST = Amplitude("lost", "1", scale=1.0, smallest=0.03, lower=0.0, upper=1.0)
# Shares of the farthest way at which a search begins.
_SHARES = (0.3, 0.5, 0.7, 0.85, 0.95)
_REACH = {
    "turn": Constant("reach", "rad", (), lower=0.01, upper=float(np.pi)),
    "travel": Constant("reach", "m", (), lower=1e-4, upper=0.2),
}


class JammedJoint(Effect):
    """Beyond a reach from rest the gripper loses a share of its turn, or of its travel; all of it where nothing gives.

    The encoders report the whole.
    """

    label = OUTSIDE
    group = "robot"
    stage = "motion"
    acts_on = ("motion",)
    words = "Beyond some reach the gripper does not follow what the robot reports."
    amplitudes = (_LOST,)

    def __init__(self, moving: Literal["turn", "travel"]) -> None:
        self.form = f"jammed_{moving}"
        self.constants = (_REACH[moving],)
        self._moving = moving

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return shares of the farthest that the gripper turns or travels in any experiment."""
        farthest = max(float(np.linalg.norm(self._path(one), axis=1).max()) for one in baseline)
        (reach,) = self.constants
        return [{reach.name: float(np.clip(share * farthest, reach.lower, reach.upper))} for share in _SHARES]

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Hold the gripper back."""
        path = self._path(motion)
        length = np.linalg.norm(path, axis=1, keepdims=True)
        excess = np.maximum(length - values["reach"], 0.0) / np.maximum(length, np.finfo(float).tiny)
        back = -values[_LOST.name] * excess * path
        if self._moving == "travel":
            return motion.moved(motion.position + back)
        return motion.moved(motion.position, Rotation.from_rotvec(back) * motion.rotation)

    def _path(self, at: Motion | Readings) -> FloatArray:
        """Return how the gripper is turned or displaced from rest, (n, 3)."""
        if self._moving == "turn":
            return np.asarray(at.rotation.as_rotvec())
        return at.position - np.asarray(at.experiment.grasp.centre)
