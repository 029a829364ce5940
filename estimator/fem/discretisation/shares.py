"""What share of the body's volume and of its surface belongs to each node: the integrals of its shape function."""

from functools import cache
from math import isqrt

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from estimator.fem.discretisation.elements import ElementKind, evaluate, reference_element
from estimator.fem.discretisation.mesh import Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# By the number of nodes along an edge.
_HEXAHEDRA: dict[int, ElementKind] = {2: "hex8", 3: "hex27", 4: "hex64"}


def nodal_volumes(mesh: Mesh) -> FloatArray:
    """Return the volume (n,) that belongs to each node, m³; their sum is the mesh's volume."""
    element = reference_element(mesh.kind)
    jacobian = np.einsum("ekx,qkr->eqxr", mesh.points[mesh.cells], element.gradient, optimize=True)
    volume = np.linalg.det(jacobian) * element.weights
    shares = np.zeros(len(mesh.points))
    np.add.at(shares, mesh.cells, volume @ element.shape)
    return shares


def nodal_weights(mesh: Mesh, specific_weight: FloatArray) -> FloatArray:
    """Return the weight (n, 3) that belongs to each node, N, of tissue that weighs (3,) N/m³."""
    if not specific_weight.any():
        return np.zeros_like(mesh.points)
    return np.outer(nodal_volumes(mesh), specific_weight)


def nodal_areas(mesh: Mesh, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the area of some faces that belongs to each node, and how it is turned.

    Parameters
    ----------
    mesh : Mesh
    faces : (f, k) nodes, as :func:`estimator.fem.discretisation.surface.boundary_faces` orders them

    Returns
    -------
    area : (n,) m²
    normals : (n, 3, 3) m², the dyad n ⊗ n of the unit normal n over that area; its trace is the area
    """
    shape, gradient, weights = _face_rule(faces.shape[1])
    edges = np.einsum("fkx,qkr->fqrx", mesh.points[faces], gradient, optimize=True)
    normal = np.cross(edges[:, :, 0], edges[:, :, 1])
    scale = np.linalg.norm(normal, axis=-1)
    unit = normal / scale[..., None]
    per_face = np.einsum("q,fq,qk,fqx,fqy->fkxy", weights, scale, shape, unit, unit, optimize=True)
    normals: FloatArray = np.zeros((len(mesh.points), 3, 3))
    np.add.at(normals, faces, per_face)
    return np.trace(normals, axis1=1, axis2=2), normals


@cache
def _face_rule(count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return shape functions (q, k), their derivatives (q, k, 2) and weights (q,) on a face with ``count`` nodes.

    A face of a reference element is where its last coordinate is least.
    """
    if count in (3, 6):
        points = np.array([[1 / 6, 1 / 6, 0.0], [2 / 3, 1 / 6, 0.0], [1 / 6, 2 / 3, 0.0]])
        shape, gradient = evaluate("tet4" if count == 3 else "tet10", points)
        nodes = [0, 1, 2] if count == 3 else [0, 1, 2, 4, 5, 6]
        return shape[:, nodes], gradient[:, nodes, :2], np.full(3, 1 / 6)
    side = isqrt(count)
    abscissae, line_weights = leggauss(side)
    first, second = (grid.ravel() for grid in np.meshgrid(abscissae, abscissae, indexing="ij"))
    points = np.stack([first, second, np.full(first.size, -1.0)], axis=1)
    shape, gradient = evaluate(_HEXAHEDRA[side], points)
    return shape[:, ::side], gradient[:, ::side, :2], np.outer(line_weights, line_weights).ravel()
