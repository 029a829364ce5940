"""Fiducial positions are rotated against the tissue frame."""

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.effects.axes import AXES
from estimator.effects.effect import Amplitude, Effect, Readings, Values


class CameraRotation(Effect):
    """Reported position = Q times the true one; the amplitudes are the rotation vector of Q in tissue axes."""

    label = "camera_rotation"
    group = "vision"
    words = "The cameras' frame is rotated against the tissue frame."
    amplitudes = tuple(
        Amplitude(f"rotation_{axis}", "rad", scale=0.02, smallest=2e-3, lower=-1.0, upper=1.0)
        for axis in AXES
    )

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Turn the positions about the origin."""
        rotation = Rotation.from_rotvec(np.array([values[amplitude.name] for amplitude in self.amplitudes]))
        change = rotation.as_matrix() - np.eye(3)
        return readings.with_fiducials(readings.fiducials + readings.fiducials @ change.T)
