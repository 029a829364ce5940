"""The cameras move slowly against the rig: no label of the catalogue."""

import numpy as np

from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import AXES


class CameraCreep(Effect):
    """Within each experiment, from its rest on, all beads seem to move, turn and spread at a constant rate.

    A tripod that sinks, a mount or a lens that warms up; each experiment begins with a look at the tissue at rest.
    """

    label = OUTSIDE
    group = "vision"
    stage = "vision"
    acts_on = ("readings",)
    linear = True
    words = "The cameras move slowly while an experiment runs."
    form = "camera_creep"
    amplitudes = (
        *(Amplitude(f"velocity_{axis}", "m/s", scale=5e-6, smallest=5e-7) for axis in AXES),
        *(Amplitude(f"rate_{axis}", "rad/s", scale=5e-5, smallest=5e-6) for axis in AXES),
        Amplitude("scale_rate", "1/s", scale=5e-5, smallest=5e-6),
    )

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Add what the beads seem to move by."""
        velocity = np.array([values[f"velocity_{axis}"] for axis in AXES])
        rate = np.array([values[f"rate_{axis}"] for axis in AXES])
        seconds = (readings.experiment.time - readings.experiment.time[0])[:, None, None]
        seeming = velocity + np.cross(rate, readings.fiducials) + values["scale_rate"] * readings.fiducials
        return readings.with_fiducials(readings.fiducials + seconds * seeming)
