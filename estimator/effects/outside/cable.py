"""Something beside the tissue pulls at the tool: no label of the catalogue."""

import numpy as np

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Readings, Values


class Cable(Effect):
    """A cable or hose between the tool beyond the sensor and a point of the room; it pulls and never pushes.

    The hook sits on the gripper frame's z axis, the far end where the constants say, in tissue axes from the gripper's
    rest. Its tension is the stiffness times what its length has grown by since the sensor was zeroed, less a slack.
    """

    label = OUTSIDE
    group = "force"
    stage = "force"
    acts_on = ("readings",)
    linear = True
    words = "A cable or something else beside the tissue pulls at the tool as it moves."
    form = "cable"
    amplitudes = (Amplitude("stiffness", "N/m", scale=10.0, smallest=1.0, lower=0.0),)
    constants = (
        Constant("end_x", "m", (0.15, -0.15), -0.5, 0.5),
        Constant("end_y", "m", (-0.15, 0.15), -0.5, 0.5),
        Constant("end_z", "m", (0.2,), -0.2, 0.6),
        Constant("hook_height", "m", (0.1,), 0.0, 0.3),
        Constant("slack", "m", (0.001,), 0.0, 0.01),
    )

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add the cable's wrench."""
        arm = readings.rotation.apply([0.0, 0.0, values["hook_height"]])
        moved = readings.position - np.asarray(readings.experiment.grasp.centre)
        away = np.array([values[f"end_{axis}"] for axis in "xyz"]) - moved - arm
        length = np.linalg.norm(away, axis=1, keepdims=True)
        stretch = np.maximum(length - length[0] - values["slack"], 0.0)
        force = values["stiffness"] * stretch * away / np.maximum(length, np.finfo(float).tiny)
        return readings.with_wrench(readings.wrench + np.hstack([force, np.cross(arm, force)]))
