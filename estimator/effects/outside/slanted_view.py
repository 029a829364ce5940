"""A bead that sinks is seen elsewhere in the plane: no label of the catalogue."""

import numpy as np

from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import AXES


class SlantedView(Effect):
    """Beads seem to move along a fixed direction by a share of how far they have sunk from where they rest.

    A window, oil or glass between the cameras and the tissue refracts the rays, or the cameras' depth axis is not the
    tissue's.
    """

    label = OUTSIDE
    group = "vision"
    stage = "vision"
    acts_on = ("readings",)
    words = "Beads that sink are seen aside, as through a window or another medium."
    form = "slanted_view"
    amplitudes = tuple(Amplitude(f"shift_{axis}_per_depth", "1", scale=0.2, smallest=0.02) for axis in AXES)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Shift the beads by their depth."""
        slant = np.array([values[f"shift_{axis}_per_depth"] for axis in AXES])
        depth = readings.rest_fiducials[:, 2] - readings.fiducials[..., 2]
        return readings.with_fiducials(readings.fiducials + depth[..., None] * slant)
