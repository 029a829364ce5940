"""The tissue sticks to a patch of the table below it: no label of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Readings, Values
from estimator.effects.places import CENTRE, belonging, places_of
from estimator.effects.support_friction import area_on_table
from estimator.experiment import Experiment
from estimator.fem.problem import RetractionProblem
from estimator.fem.steady import NodalSprings
from estimator.fem.terms import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_STIFFNESS = Amplitude("stiffness_over_modulus", "1/m", scale=100.0, smallest=2.0, lower=0.0, upper=1e5)
_RADIUS = Constant("radius", "m", (0.01,), lower=0.003, upper=0.04)


class StickyPatch(Effect):
    """Springs hold the underside within a circle to where it was at rest: per area, stiffness times Young's modulus.

    A film of glue or water of height h and modulus E' holds with E' / h per area.
    """

    label = OUTSIDE
    group = "environment"
    words = "The tissue sticks to a patch of the table below it."
    form = "sticky_patch"
    mistaken_for = ("inhomogeneity",)
    amplitudes = (_STIFFNESS,)
    constants = (*CENTRE, _RADIUS)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the grid, spread over the phantom's edges, without the places inside the grasp."""
        return places_of(baseline[0].experiment, super().starts(baseline))

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the patch's centre and radius."""
        below = float(problem.body.mesh.points[:, 2].min())
        return np.array([values["centre_x"], values["centre_y"], below]), values[_RADIUS.name]

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Hold the nodes of the underside within the patch."""
        if not values[_STIFFNESS.name]:
            return ()
        area = area_on_table(problem)
        centre = np.array([values["centre_x"], values["centre_y"]])
        depth = values[_RADIUS.name] - np.linalg.norm(problem.body.mesh.points[:, :2] - centre, axis=1)
        inside = belonging(depth, np.sqrt(area))
        stiffness = values[_STIFFNESS.name] * material.youngs_modulus * area * inside
        return (NodalSprings(stiffness[:, None, None] * np.eye(3)),)
