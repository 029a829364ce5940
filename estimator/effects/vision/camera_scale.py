"""The cameras' scale is off."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Values
from estimator.effects.shared.of_each_experiment import SeenOfEachExperiment
from estimator.effects.vision.camera_frame import CameraFrame, Measured, Origin

FloatArray = NDArray[np.float64]

_SCALE = Amplitude("scale_error", "1", scale=0.015, smallest=1e-3, lower=-0.5)
_DEPTH = Amplitude("depth_error", "1", scale=0.015, smallest=1e-3, lower=-0.5)


class CameraScale(CameraFrame):
    """M = s: a wrong baseline or focal length of the stereo pair, or a wrong pitch of its board."""

    label = "camera_scale"
    linear = True
    measured_by = "compare the beads' spacing at rest with the design grid"
    words = "The cameras' scale is off: beads appear too far from, or too near to, some point."
    of_frame: ClassVar[tuple[Amplitude, ...]] = (_SCALE,)

    def __init__(
        self,
        form: str = "uniform",
        measured: Measured = "readings",
        origin: Origin = "of_the_tissue_frame",
    ) -> None:
        super().__init__(form, measured, origin)

    def matrix(self, values: Values) -> FloatArray:
        """Return the scale along x, y and z."""
        return values["scale_error"] * np.eye(3)


class CameraScaleInPlane(CameraScale):
    """Along x and y alone: seen from above, with true depth."""

    def matrix(self, values: Values) -> FloatArray:
        """Return the scale along x and y."""
        return values["scale_error"] * np.diag([1.0, 1.0, 0.0])


class CameraScaleAndDepth(CameraScale):
    """Along x and y, and another along z: the depth of a stereo pair has an error of its own."""

    of_frame = (_SCALE, _DEPTH)

    def matrix(self, values: Values) -> FloatArray:
        """Return the scales."""
        return np.diag([values["scale_error"], values["scale_error"], values["depth_error"]])


class CameraScaleOfEach(SeenOfEachExperiment, CameraScale):
    """The cameras were focused, or their pair set up, anew before each experiment."""


CAMERA_SCALE = (
    CameraScale(),
    CameraScaleInPlane("in_the_plane"),
    CameraScale("of_the_motion", "motion"),
    CameraScaleAndDepth("about_any_point", "readings", "anywhere"),
    CameraScaleAndDepth("rest_measured_too", "both", "anywhere"),
    CameraScaleAndDepth("of_rest_alone", "rest", "anywhere"),
    CameraScaleOfEach(CameraScaleAndDepth("about_any_point", "readings", "anywhere")),
)
