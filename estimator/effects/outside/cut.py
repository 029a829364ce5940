"""The tissue is cut, has torn, or is missing at some place: no label of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.places import CENTRE, belonging, places_of
from estimator.effects.tissue.inhomogeneity import Inhomogeneity
from estimator.effects.vision.fiducial_misread import FiducialMisread
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.quadrature import points_of_parts

FloatArray = NDArray[np.float64]

# Nothing, but for a hundredth, is left of the stiffness at the upper bound.
_LOG_SOFTNESS = Amplitude("log_softness", "1", scale=3.0, smallest=0.3, lower=0.0, upper=5.0)
_HALF_LENGTH = Constant("half_length", "m", (0.006,), lower=0.003, upper=0.04)
_NORMAL = Constant("normal", "rad", (0.0, float(np.pi / 2)), lower=-np.pi / 2, upper=np.pi)
# Half the stripe's width. Drawn by a mesh coarser than it, on a cut of 13 mm, one of 1 to 1.5 mm was found more slowly.
_HALF_WIDTH_M = 2.5e-3


class Cut(Effect):
    """A cut through the thickness: a slender stripe that bears next to nothing.

    A slender stripe bears little along itself whatever it is made of, so that its stiffness may be lost in all
    directions: taken from the stress across it alone, it would make the tissue unstable where that is stretched far.
    The stripe's normal lies in the plane, at ``normal`` from the x axis towards y.
    """

    label = OUTSIDE
    group = "inhomogeneity"
    stage = "tissue"
    acts_on = ("log_modulus",)
    words = "The tissue is cut, torn or missing at a place."
    within_elements = True
    form = "cut"
    mistaken_for = (Inhomogeneity.label, FiducialMisread.label)
    amplitudes = (_LOG_SOFTNESS,)
    constants = (*CENTRE, _HALF_LENGTH, _NORMAL)

    def __init__(self, region: Values | None = None) -> None:
        """Look for a cut everywhere, or within a region: its centre and half the cut's length."""
        self._region = region

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the grid, spread over the phantom's edges, without the places inside the grasp; or the region."""
        if self._region is not None:
            return [{**self._region, _NORMAL.name: normal} for normal in _NORMAL.grid]
        return places_of(baseline[0].experiment, super().starts(baseline))

    def looked_for_at(self, centre: FloatArray, radius_m: float) -> Effect:
        """Return the cut as it is looked for within what it is mistaken for, at least as long as the grid's."""
        half_length = max(radius_m, _HALF_LENGTH.grid[0])
        return Cut({CENTRE[0].name: centre[0], CENTRE[1].name: centre[1], _HALF_LENGTH.name: half_length})

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the cut's middle and half its length."""
        return np.array([values["centre_x"], values["centre_y"], 0.0]), values[_HALF_LENGTH.name]

    def log_modulus(self, problem: RetractionProblem, values: Values) -> FloatArray | None:
        """Return the logarithm of the stiffness left, (e, q), by how much of a point's part lies in the cut."""
        log_softness = values[_LOG_SOFTNESS.name]
        if not log_softness:
            return None
        points = points_of_parts(problem.body.mesh)
        arms = points[..., :2] - [values["centre_x"], values["centre_y"]]
        cos, sin = np.cos(values[_NORMAL.name]), np.sin(values[_NORMAL.name])
        spacing_m = np.cbrt(problem.body.rest_volume)[..., None]
        across = _between(arms @ [cos, sin], _HALF_WIDTH_M, spacing_m)
        along = _between(arms @ [-sin, cos], values[_HALF_LENGTH.name], spacing_m)
        return np.asarray(-log_softness * (across * along).mean(axis=2))


def _between(position_m: FloatArray, half_m: float, spacing_m: FloatArray) -> FloatArray:
    """Return how far positions lie between minus and plus ``half_m``, from 0 to 1, smoothly over their spacing."""
    return belonging(half_m - position_m, spacing_m) + belonging(half_m + position_m, spacing_m) - 1.0
