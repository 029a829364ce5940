"""The tissue's underside on the table, and what acts on it within a circle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Effect, Readings, Values
from estimator.effects.shared.places import belonging, places_of
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.shares import nodal_areas
from estimator.fem.discretisation.surface import boundary_faces

FloatArray = NDArray[np.float64]

# Faces this close to the lowest node (as a share of the phantom's height) lie on the table.
_ON_TABLE = 0.02


class OnTable(Effect):
    """An effect whose constants ``centre_x``, ``centre_y`` and ``radius``, m, are those of a circle on the table."""

    within_elements: ClassVar[bool] = True
    needs_table: ClassVar[bool] = True

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the grid, spread over the phantom's edges, without the places inside the grasp."""
        return places_of(baseline[0].experiment, super().starts(baseline))

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the circle's centre and radius."""
        below = float(problem.body.mesh.points[:, 2].min())
        return np.array([values["centre_x"], values["centre_y"], below]), values["radius"]


def area_on_table(problem: RetractionProblem) -> FloatArray:
    """Return the area (n,), m², with which each node lies on the table."""
    mesh = problem.body.mesh
    height = mesh.points[:, 2] - mesh.points[:, 2].min()
    faces = boundary_faces(mesh)
    lying = np.all(height[faces] <= _ON_TABLE * height.max(), axis=1)
    area, _ = nodal_areas(mesh, faces[lying])
    return np.clip(area, 0.0, None)


def area_within(problem: RetractionProblem, values: Values) -> FloatArray:
    """Return the area (n,), m², with which each node lies on the table within the circle."""
    area = area_on_table(problem)
    centre = np.array([values["centre_x"], values["centre_y"]])
    depth = values["radius"] - np.linalg.norm(problem.body.mesh.points[:, :2] - centre, axis=1)
    return area * belonging(depth, np.sqrt(area))
