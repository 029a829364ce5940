"""Write down a departure of your rig from the model, and look at what it does to the measurements.

The tool between flange and gripper bends under its own weight, by the part of gravity across its axis: lying level its
tip is down by the sag, upright by nothing. The robot does not know.

For ``retract simulate --effect``, and for the diagnosis, a package declares it: examples/heated-jaws shows how.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator import Amplitude, Catalogue, Effect, Experiment, simulate
from estimator.effects.catalogue import default_catalogue
from estimator.effects.effect import Motion, Values

FloatArray = NDArray[np.float64]


class ToolFlex(Effect):
    """The gripper is where the robot says, and aside by what the tool bends otherwise than at rest."""

    label = "tool_flex"
    group = "robot"
    stage = "motion"
    acts_on = ("motion",)
    measured_by = "lay a dial gauge to the gripper while it turns in free air"
    words = "The tool bends under its own weight when the gripper turns."
    amplitudes = (Amplitude("sag", "m", scale=5e-4, smallest=5e-5, lower=0.0),)

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Move the gripper by what the tool bends more, or less, than at rest."""
        gravity = np.asarray(motion.experiment.environment.gravity)
        down, upright = gravity / np.linalg.norm(gravity), np.array([[0.0, 0.0, 1.0]])
        more = _across(down, motion.rotation.apply(upright[0])) - _across(down, upright)
        return motion.moved(motion.position + values["sag"] * more)


def _across(down: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the part of a direction (3,) that is across axes (n, 3) of unit length."""
    return np.asarray(down - (axis @ down)[:, None] * axis)


def catalogue() -> Catalogue:
    """Return all effects that are known, and this one in its place among them."""
    return default_catalogue().with_effect(ToolFlex())


def main(steps: int = 6, mesh: Literal["fine", "coarse"] = "fine") -> float:
    """Print by how much the force along y is off with a sag of 2 mm while the gripper tilts; return it, N."""
    tilt = np.outer(np.arange(steps + 1), [0.6 / steps, 0.0, 0.0])
    planned = Experiment.of_block(np.zeros_like(tilt), tilt, name="tilt")
    (stiff,) = simulate(planned, mesh=mesh)
    (bent,) = simulate(planned, effects=[(ToolFlex(), {"sag": 2e-3})], mesh=mesh)
    labels = catalogue().labels
    print(
        f"{ToolFlex.label} acts after {labels[labels.index(ToolFlex.label) - 1]}, one of {len(labels)} causes"
    )
    off = float(np.abs(bent.wrench[:, 1] - stiff.wrench[:, 1]).max())
    print(f"it moves fy by up to {off:.3f} N; the sensor's noise is {planned.sensor.force_std:g} N")
    return off


if __name__ == "__main__":
    main()
