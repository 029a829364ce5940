"""Something beside the tissue pulls at the tool: no label of the catalogue."""

import numpy as np

from estimator.effects.axes import AXES
from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Readings, Values

_PAIRS = tuple((i, j) for i in range(3) for j in range(i, 3))


class Cable(Effect):
    """A cable or hose hooked to the tool beyond the sensor pulls back as the tool moves.

    Its force on the tool is -K d, d being the way of the hook from where the sensor was zeroed and K a symmetric
    stiffness; the hook sits on the gripper frame's z axis.
    """

    label = OUTSIDE
    group = "force"
    words = "A cable or something else beside the tissue pulls at the tool as it moves."
    form = "cable"
    amplitudes = tuple(
        Amplitude(f"stiffness_{AXES[i]}{AXES[j]}", "N/m", scale=10.0, smallest=1.0) for i, j in _PAIRS
    )
    constants = (Constant("hook_height", "m", (0.1,), -0.3, 0.3),)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add the cable's wrench."""
        stiffness = np.zeros((3, 3))
        for i, j in _PAIRS:
            stiffness[i, j] = stiffness[j, i] = values[f"stiffness_{AXES[i]}{AXES[j]}"]
        hook = np.array([0.0, 0.0, values["hook_height"]])
        arm = readings.rotation.apply(hook)
        way = readings.position - np.asarray(readings.experiment.grasp.centre) + arm - hook
        force = -way @ stiffness
        return readings.with_wrench(readings.wrench + np.hstack([force, np.cross(arm, force)]))
