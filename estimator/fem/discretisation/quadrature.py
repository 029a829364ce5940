"""Where the integration points of a mesh lie, and the parts of an element that they stand for."""

from functools import cache
from itertools import pairwise, product

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from estimator.fem.discretisation.elements import ElementKind, evaluate, reference_element
from estimator.fem.discretisation.mesh import Mesh

FloatArray = NDArray[np.float64]

# Samples along each edge of a part of a hexahedron, and steps of the lattice along that of a tetrahedron.
_ALONG_A_PART, _ALONG_A_TETRAHEDRON = 3, 7


def quadrature_points(mesh: Mesh) -> FloatArray:
    """Return the positions (e, q, 3) of the integration points at rest, tissue frame, m."""
    shape = reference_element(mesh.kind).shape
    return np.einsum("qk,ekx->eqx", shape, mesh.points[mesh.cells], optimize=True)


def points_of_parts(mesh: Mesh) -> FloatArray:
    """Return positions (e, q, s, 3) spread evenly over the part of its element that an integration point stands for.

    At rest, tissue frame, m. The mean over them says how much of a part lies in a region that ends within the element;
    the integration point alone says all or nothing.
    """
    samples = _samples_of_parts(mesh.kind)
    shape = evaluate(mesh.kind, samples.reshape(-1, 3))[0]
    points = np.einsum("pk,ekx->epx", shape, mesh.points[mesh.cells], optimize=True)
    return points.reshape(len(points), *samples.shape)


@cache
def _samples_of_parts(kind: ElementKind) -> FloatArray:
    """Return points (q, s, 3) of the reference element spread evenly over the part of each integration point."""
    points = reference_element(kind).points
    if kind in ("tet4", "tet10"):
        return _samples_of_tetrahedron(points)
    weights = leggauss(round(len(points) ** (1 / 3)))[1]
    ends = np.concatenate([[0.0], np.cumsum(weights)]) - 1.0
    middles = (np.arange(_ALONG_A_PART) + 0.5) / _ALONG_A_PART
    lines = [low + (high - low) * middles for low, high in pairwise(ends)]
    return np.array([list(product(*of_point)) for of_point in product(lines, repeat=3)])


def _samples_of_tetrahedron(points: FloatArray) -> FloatArray:
    """Return a lattice's points, each with the integration point (q, 3) next to it; those between two are left out."""
    steps = _ALONG_A_TETRAHEDRON
    lattice = [each for each in product(range(steps + 1), repeat=3) if sum(each) <= steps]
    samples = (np.array(lattice) + 0.25) / (steps + 1)
    # By distance in barycentric coordinates no corner is preferred.
    all_four, of_points = (np.column_stack([1.0 - each.sum(axis=1), each]) for each in (samples, points))
    distance = np.linalg.norm(all_four[:, None] - of_points, axis=-1)
    nearest = np.isclose(distance, distance.min(axis=1, keepdims=True))
    return np.array([samples[nearest[:, q] & (nearest.sum(axis=1) == 1)] for q in range(len(points))])
