"""The cameras' frame is turned against the tissue frame."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Amplitude, Values
from estimator.effects.shared.axes import AXES
from estimator.effects.shared.of_each_experiment import SeenOfEachExperiment
from estimator.effects.vision.camera_frame import CameraFrame

FloatArray = NDArray[np.float64]


class CameraRotation(CameraFrame):
    """M = Q − 1; the amplitudes are the rotation vector of Q in tissue axes."""

    label = "camera_rotation"
    measured_by = "compare the beads' places at rest with the design grid"
    words = "The cameras' frame is rotated against the tissue frame."
    of_frame = tuple(
        Amplitude(f"rotation_{axis}", "rad", scale=0.02, smallest=2e-3, lower=-1.0, upper=1.0)
        for axis in AXES
    )

    def matrix(self, values: Values) -> FloatArray:
        """Return the turn less the identity."""
        rotation = Rotation.from_rotvec([values[amplitude.name] for amplitude in self.of_frame])
        return np.asarray(rotation.as_matrix() - np.eye(3))


class CameraRotationOfEach(SeenOfEachExperiment, CameraRotation):
    """The cameras were knocked between experiments, or turned back."""


CAMERA_ROTATION = (
    CameraRotation("of_positions"),
    CameraRotation("of_the_motion", "motion"),
    CameraRotation("about_any_point", "readings", "anywhere"),
    CameraRotation("rest_measured_too", "both", "anywhere"),
    CameraRotation("of_rest_alone", "rest", "anywhere"),
    CameraRotationOfEach(CameraRotation("about_any_point", "readings", "anywhere")),
)
