"""Fiducial positions are scaled about the tissue frame's origin."""

from estimator.effects.effect import Amplitude, Effect, Readings, Values


class CameraScale(Effect):
    """Reported position = (1 + s) times the true one: a wrong baseline or focal length of the stereo pair."""

    label = "camera_scale"
    group = "vision"
    words = (
        "The cameras' scale is off: fiducials appear too far from or too near to the tissue frame's origin."
    )
    amplitudes = (Amplitude("scale_error", "1", scale=0.015, smallest=1e-3, lower=-0.5),)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the positions."""
        return readings.with_fiducials((1.0 + values["scale_error"]) * readings.fiducials)
