"""Fiducial positions are scaled about the tissue frame's origin."""

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Readings, Values

FloatArray = NDArray[np.float64]


class CameraScale(Effect):
    """Reported position = (1 + s) times the true one: a wrong baseline or focal length of the stereo pair."""

    label = "camera_scale"
    group = "vision"
    stage = "vision"
    acts_on = ("seen", "readings")
    linear = True
    measured_by = "compare the beads' spacing at rest with the design grid"
    words = (
        "The cameras' scale is off: fiducials appear too far from or too near to the tissue frame's origin."
    )
    inexactness = HARDLY_INEXACT
    form = "uniform"
    amplitudes = (Amplitude("scale_error", "1", scale=0.015, smallest=1e-3, lower=-0.5),)

    def seen(self, positions: FloatArray, values: Values) -> FloatArray:
        """Return the positions scaled."""
        return (1.0 + values["scale_error"]) * positions

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the positions."""
        return readings.with_fiducials(
            self.seen(readings.fiducials, values), self.seen(readings.rest_fiducials, values)
        )


class CameraScaleInPlane(CameraScale):
    """Along x and y alone: a wrong focal length or a wrong pitch of the board, seen from above, with true depth."""

    form = "in_the_plane"

    def seen(self, positions: FloatArray, values: Values) -> FloatArray:
        """Return the positions scaled along x and y."""
        return (1.0 + values["scale_error"] * np.array([1.0, 1.0, 0.0])) * positions


class CameraScaleOfMotion(CameraScale):
    """The same cameras measured the rest positions, so that motion alone is scaled."""

    form = "of_the_motion"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the motion since rest."""
        surplus = values["scale_error"] * readings.rest_fiducials
        return readings.with_fiducials(self.seen(readings.fiducials, values) - surplus)
