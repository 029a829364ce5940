"""Fiducial positions are scaled about the tissue frame's origin."""

import numpy as np

from estimator.effects.effect import Amplitude, Effect, Readings, Values


class CameraScale(Effect):
    """Reported position = (1 + s) times the true one: a wrong baseline or focal length of the stereo pair."""

    label = "camera_scale"
    group = "vision"
    words = (
        "The cameras' scale is off: fiducials appear too far from or too near to the tissue frame's origin."
    )
    form = "uniform"
    amplitudes = (Amplitude("scale_error", "1", scale=0.015, smallest=1e-3, lower=-0.5),)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the positions."""
        return readings.with_fiducials((1.0 + values["scale_error"]) * readings.fiducials)


class CameraScaleInPlane(CameraScale):
    """Along x and y alone: a wrong focal length or a wrong pitch of the board, seen from above, with true depth."""

    form = "in_the_plane"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale x and y."""
        factors = 1.0 + values["scale_error"] * np.array([1.0, 1.0, 0.0])
        return readings.with_fiducials(factors * readings.fiducials)


class CameraScaleOfMotion(CameraScale):
    """The same cameras measured the rest positions, so that motion alone is scaled."""

    form = "of_the_motion"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the motion since rest."""
        scaled = super().readings(readings, values)
        surplus = values["scale_error"] * readings.rest_fiducials
        return scaled.with_fiducials(scaled.fiducials - surplus)
