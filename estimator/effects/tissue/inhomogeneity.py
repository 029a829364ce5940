"""A region is stiffer or softer than the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.places import CENTRE, belonging, places_of
from estimator.effects.stages import Hook, Stage
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.quadrature import points_of_parts

FloatArray = NDArray[np.float64]
RegionShape = Literal["cylinder", "sphere"]

_LOG_RATIO = Amplitude("log_stiffness_ratio", "1", scale=1.0, smallest=0.1, lower=-5.0, upper=5.0)
_RADIUS = Constant("radius", "m", (0.009, 0.016), lower=0.004, upper=0.04)
# Half the width over which a gradual region ends.
_RIM = Constant("rim", "m", (0.003,), lower=1e-3, upper=0.02)
_ELONGATIONS = tuple(
    Constant(f"elongation_{way}", "1", (0.0,), lower=-1.2, upper=1.2) for way in ("x", "diagonal")
)


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
        points = points_of_parts(problem.body.mesh)
        spacing_m = np.cbrt(problem.body.rest_volume)[..., None]
        return np.asarray(log_ratio * self._inside(points, spacing_m, values).mean(axis=2))

    def _inside(self, points: FloatArray, spacing_m: FloatArray, values: Values) -> FloatArray:
        """Return how far points (..., 3) belong to the region, from 0 to 1, smoothly over their spacing at the rim."""
        centre = np.array([values["centre_x"], values["centre_y"], 0.0])
        return _Region(self._shape, centre, values[_RADIUS.name]).inside(points, spacing_m)


class GradedInhomogeneity(Inhomogeneity):
    """An oblong cylinder through the thickness whose stiffness goes over gradually into that of the rest.

    Its contour is the circle of the radius, stretched by exp(e/2) along one axis and shortened by as much across it.
    The elongations along x, and along the diagonal of x and y, are e cos 2θ and e sin 2θ for an axis at θ from x.
    """

    constants = (*Inhomogeneity.constants, _RIM, *_ELONGATIONS)

    def __init__(self) -> None:
        super().__init__("cylinder")
        self.form = "graded"
        self.elaborates = "cylinder"

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return nothing: it begins where a round one has been found."""
        return []

    def _inside(self, points: FloatArray, spacing_m: FloatArray, values: Values) -> FloatArray:
        along_x, along_diagonal = (values[one.name] for one in _ELONGATIONS)
        elongation = float(np.hypot(along_x, along_diagonal))
        shape = np.array([[along_x, along_diagonal], [along_diagonal, -along_x]])
        # The matrix exponential of −shape/2; sinh(e/2)/e is ½ where it is round.
        steep = np.sinh(elongation / 2) / elongation if elongation else 0.5
        back = np.cosh(elongation / 2) * np.eye(2) - steep * shape
        arms = (points[..., :2] - [values["centre_x"], values["centre_y"]]) @ back
        depth = values[_RADIUS.name] - np.linalg.norm(arms, axis=-1)
        return belonging(depth, np.maximum(2 * values[_RIM.name], spacing_m))


INHOMOGENEITY = (Inhomogeneity("cylinder"), Inhomogeneity("sphere"), GradedInhomogeneity())
