"""Anchors that yield: the anchored surface, and the problem with some of its nodes set free."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.fem.problem import RetractionProblem
from estimator.fem.shares import nodal_areas
from estimator.fem.surface import boundary_faces
from estimator.fem.tangent import tangent_pattern

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def anchored_areas(problem: RetractionProblem) -> tuple[FloatArray, FloatArray]:
    """Return the anchored area (n,), m², of each node, and the dyad (n, 3, 3) of its normals over that area.

    A face counts where all of its nodes are held and one of them at least by an anchor; what the gripper holds is
    none of the anchors'.
    """
    anchored = problem.anchored
    faces = boundary_faces(problem.body.mesh)
    held = (anchored | problem.gripped)[faces].all(axis=1) & anchored[faces].any(axis=1)
    area, normals = nodal_areas(problem.body.mesh, faces[held])
    return np.where(anchored, area, 0.0), np.where(anchored[:, None, None], normals, 0.0)


def set_free(
    problem: RetractionProblem, freed: BoolArray, attachment: FloatArray | None = None
) -> RetractionProblem:
    """Return the problem whose nodes ``freed`` (n,) no longer stand still, with another attachment where given."""
    fixed = problem.fixed & ~freed
    return replace(
        problem,
        fixed=fixed,
        attachment=problem.attachment if attachment is None else attachment,
        pattern=tangent_pattern(problem.body.mesh, fixed, problem.gripped),
    )
