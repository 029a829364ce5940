"""What acts on the tissue's underside within a circle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Effect, Readings, Values
from estimator.effects.mounting.support_friction import area_on_table
from estimator.effects.shared.places import belonging, places_of
from estimator.fem.problem import RetractionProblem

FloatArray = NDArray[np.float64]


class OnTable(Effect):
    """An effect whose constants ``centre_x``, ``centre_y`` and ``radius``, m, are those of a circle on the table."""

    within_elements: ClassVar[bool] = True

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the grid, spread over the phantom's edges, without the places inside the grasp."""
        return places_of(baseline[0].experiment, super().starts(baseline))

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the circle's centre and radius."""
        below = float(problem.body.mesh.points[:, 2].min())
        return np.array([values["centre_x"], values["centre_y"], below]), values["radius"]


def area_within(problem: RetractionProblem, values: Values) -> FloatArray:
    """Return the area (n,), m², with which each node lies on the table within the circle."""
    area = area_on_table(problem)
    centre = np.array([values["centre_x"], values["centre_y"]])
    depth = values["radius"] - np.linalg.norm(problem.body.mesh.points[:, :2] - centre, axis=1)
    return area * belonging(depth, np.sqrt(area))
