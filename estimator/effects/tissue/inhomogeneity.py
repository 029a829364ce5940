"""A region is stiffer or softer than the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Hook, Readings, Stage, Values
from estimator.effects.shared.places import CENTRE, belonging, places_of
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.quadrature import points_of_parts

FloatArray = NDArray[np.float64]
RegionShape = Literal["cylinder", "sphere"]

_LOG_RATIO = Amplitude("log_stiffness_ratio", "1", scale=1.0, smallest=0.1, lower=-5.0, upper=5.0)
_RADIUS = Constant("radius", "m", (0.009, 0.016), lower=0.004, upper=0.04)


@dataclass(frozen=True)
class _Region:
    """A region about a place in the mid-plane."""

    shape: RegionShape
    centre: FloatArray
    radius_m: float

    def inside(self, points: FloatArray, spacing_m: FloatArray) -> FloatArray:
        """Return how far points (..., 3) belong to it, from 0 to 1, smoothly over their spacing at the rim."""
        arms = points - self.centre
        axes = 2 if self.shape == "cylinder" else 3
        depth = self.radius_m - np.linalg.norm(arms[..., :axes], axis=-1)
        return belonging(depth, spacing_m)


class Inhomogeneity(Effect):
    """A cylinder through the thickness, or a sphere in the mid-plane."""

    label: ClassVar[str] = "inhomogeneity"
    group: ClassVar[Group] = "inhomogeneity"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("log_modulus",)
    words: ClassVar[str] = "A region of the tissue is stiffer or softer than the rest."
    within_elements: ClassVar[bool] = True
    amplitudes = (_LOG_RATIO,)
    constants = (*CENTRE, _RADIUS)

    def __init__(self, form: RegionShape) -> None:
        self.form = form
        self._shape = form
        self.elaborates = "" if form == "cylinder" else "cylinder"

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the grid, spread over the phantom's edges, without the places inside the grasp."""
        return places_of(baseline[0].experiment, super().starts(baseline))

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the region's centre and radius."""
        return np.array([values["centre_x"], values["centre_y"], 0.0]), values[_RADIUS.name]

    def log_modulus(self, problem: RetractionProblem, values: Values) -> FloatArray | None:
        """Return the logarithm of the stiffness ratio, (e, q), by how much of a point's part lies in it."""
        log_ratio = values[_LOG_RATIO.name]
        if not log_ratio:
            return None
        centre = np.array([values["centre_x"], values["centre_y"], 0.0])
        region = _Region(self._shape, centre, values[_RADIUS.name])
        points = points_of_parts(problem.body.mesh)
        spacing_m = np.cbrt(problem.body.volume)[..., None]
        return np.asarray(log_ratio * region.inside(points, spacing_m).mean(axis=2))


INHOMOGENEITY = (Inhomogeneity("cylinder"), Inhomogeneity("sphere"))
