"""The modulus changes steadily across the phantom."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Effect, Values
from estimator.effects.stages import Hook, Stage
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.quadrature import quadrature_points

FloatArray = NDArray[np.float64]

# 30 % across the paper's sheet of 100 mm, and across its thickness of 10 mm.
_SCALES_PER_M = {"x": 3.0, "y": 3.0, "z": 30.0}
# 30 % from the middle of that sheet to its sides, 50 mm away.
_BEND_PER_M2 = 240.0


class ModulusGradient(Effect):
    """The logarithm of the modulus is linear in the place, and as stated in the phantom's centre.

    Parameters
    ----------
    form : what the instance is called
    axes : along which it changes, of "xyz"
    """

    label: ClassVar[str] = "modulus_gradient"
    group: ClassVar[Group] = "inhomogeneity"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("log_modulus",)
    words: ClassVar[str] = "The tissue's modulus changes steadily across the phantom."

    def __init__(self, form: str, axes: str) -> None:
        self.form = form
        self._axes = ["xyz".index(axis) for axis in axes]
        self.amplitudes = tuple(
            Amplitude(f"log_modulus_by_{axis}", "1/m", _SCALES_PER_M[axis], 0.1 * _SCALES_PER_M[axis])
            for axis in axes
        )

    def log_modulus(self, problem: RetractionProblem, values: Values) -> FloatArray | None:
        """Return the logarithm of the modulus at the integration points over that in the centre, (e, q)."""
        sizes = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        if not sizes.any():
            return None
        return self._log_profile(problem.body.mesh, sizes)

    def _log_profile(self, mesh: Mesh, sizes: FloatArray) -> FloatArray:
        """Return the same for amplitudes (a,), such as slopes along the axes, 1/m."""
        return np.asarray(quadrature_points(mesh)[..., self._axes] @ sizes)


class LinearModulusGradient(ModulusGradient):
    """The modulus itself is linear along each axis.

    Its amplitude is the logarithm of the ratio of the moduli at opposite sides, by their distance: they stay positive,
    and a small one does the same as that of a linear logarithm.
    """

    def _log_profile(self, mesh: Mesh, sizes: FloatArray) -> FloatArray:
        nodes = mesh.points[:, self._axes]
        middle, half = (nodes.max(axis=0) + nodes.min(axis=0)) / 2, np.ptp(nodes, axis=0) / 2
        steepness = np.tanh(sizes * half) / half
        along = quadrature_points(mesh)[..., self._axes] - middle
        return np.asarray(np.sum(np.log((1 + steepness * along) / (1 - steepness * middle)), axis=-1))


class CurvedModulusGradient(ModulusGradient):
    """The logarithm of the modulus is quadratic in the place: its middle is stiffer or softer than its sides.

    It is the sum of s x + ½ c x² over the axes, s the slope in the phantom's centre and c the curvature along an axis,
    as of tissue that dried or cured from its sides.
    """

    def __init__(self, form: str, axes: str) -> None:
        super().__init__(form, axes)
        self.amplitudes += tuple(
            Amplitude(f"log_modulus_curvature_{axis}", "1/m2", _BEND_PER_M2, 0.1 * _BEND_PER_M2)
            for axis in axes
        )

    def _log_profile(self, mesh: Mesh, sizes: FloatArray) -> FloatArray:
        slope, curvature = np.split(sizes, 2)
        along = quadrature_points(mesh)[..., self._axes]
        return np.asarray(along @ slope + 0.5 * along**2 @ curvature)


MODULUS_GRADIENT = (
    ModulusGradient("in_plane", "xy"),
    ModulusGradient("through_thickness", "z"),
    LinearModulusGradient("linear_in_plane", "xy"),
    LinearModulusGradient("linear_through_thickness", "z"),
    CurvedModulusGradient("curved_in_plane", "xy"),
)
