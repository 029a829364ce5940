"""Fiducial positions are rotated against the tissue frame."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Readings, Values
from estimator.effects.shared.axes import AXES

FloatArray = NDArray[np.float64]


class CameraRotation(Effect):
    """Reported position = Q times the true one; the amplitudes are the rotation vector of Q in tissue axes."""

    label = "camera_rotation"
    group = "vision"
    stage = "vision"
    acts_on = ("seen", "readings")
    measured_by = "compare the beads' places at rest with the design grid"
    words = "The cameras' frame is rotated against the tissue frame."
    inexactness = HARDLY_INEXACT
    amplitudes = tuple(
        Amplitude(f"rotation_{axis}", "rad", scale=0.02, smallest=2e-3, lower=-1.0, upper=1.0)
        for axis in AXES
    )

    def seen(self, positions: FloatArray, values: Values) -> FloatArray:
        """Return the positions turned about the origin."""
        rotation = Rotation.from_rotvec(np.array([values[amplitude.name] for amplitude in self.amplitudes]))
        change = rotation.as_matrix() - np.eye(3)
        return positions + positions @ change.T

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Turn the positions about the origin."""
        return readings.with_fiducials(
            self.seen(readings.fiducials, values), self.seen(readings.rest_fiducials, values)
        )
