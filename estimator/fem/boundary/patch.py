"""A held patch of the surface: which points lie on it, and how far others are from it."""

import numpy as np
from numpy.typing import NDArray

from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces, facets
from estimator.surfaces.queries import nearest

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def on_patch(mesh: Mesh, held: BoolArray, points: FloatArray, within_m: float) -> BoolArray:
    """Tell of points (m, 3), m, whether they lie on the patch whose nodes (n,) are held, or so near to it."""
    pieces = facets(boundary_faces(mesh))
    triangle, foot = nearest(mesh.points[pieces], points)
    near = np.linalg.norm(points - foot, axis=1) <= within_m
    return np.asarray(near & held[pieces[triangle]].all(axis=1))


def from_patch(mesh: Mesh, held: BoolArray, points: FloatArray) -> FloatArray:
    """Return how far points (m, 3) are from the patch whose nodes (n,) are held, (m,), m."""
    pieces = facets(boundary_faces(mesh))
    _, foot = nearest(mesh.points[pieces[held[pieces].all(axis=1)]], points)
    return np.asarray(np.linalg.norm(points - foot, axis=1))
