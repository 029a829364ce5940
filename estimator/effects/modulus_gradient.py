"""The modulus changes steadily across the phantom."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Effect, Group, Values
from estimator.fem.problem import RetractionProblem
from estimator.fem.quadrature import quadrature_points

FloatArray = NDArray[np.float64]

# 30 % across the paper's sheet of 100 mm, and across its thickness of 10 mm.
_SCALES_PER_M = {"x": 3.0, "y": 3.0, "z": 30.0}


class ModulusGradient(Effect):
    """The logarithm of the modulus is linear in the place, and as stated in the phantom's centre.

    Parameters
    ----------
    form : what the instance is called
    axes : along which it changes, of "xyz"
    """

    label: ClassVar[str] = "modulus_gradient"
    group: ClassVar[Group] = "inhomogeneity"
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
        slopes = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        if not slopes.any():
            return None
        return np.asarray(quadrature_points(problem.body.mesh)[..., self._axes] @ slopes)


MODULUS_GRADIENT = (ModulusGradient("in_plane", "xy"), ModulusGradient("through_thickness", "z"))
