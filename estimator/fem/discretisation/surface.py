"""The surface of a mesh: the element faces that belong to one element only."""

from functools import cache
from itertools import pairwise, product
from math import isqrt

import numpy as np
from numpy.typing import NDArray

from estimator.fem.discretisation.elements import ElementKind, reference_element
from estimator.fem.discretisation.mesh import Mesh

IntArray = NDArray[np.int64]

# Corners of the faces of a tetrahedron, anticlockwise seen from outside.
_TETRAHEDRON_FACES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))


def boundary_faces(mesh: Mesh) -> IntArray:
    """Return the nodes (f, k) of every element face on the surface of a mesh.

    The k nodes of a hexahedron's face are the rows of a square lattice, those of a tetrahedron's its corners and
    then the middles of its edges 0–1, 1–2, 2–0. The normal by the right-hand rule (along the lattice's first, then
    its second direction; around the corners) points out of the body.
    """
    faces = mesh.cells[:, _local_faces(mesh.kind)]
    faces = faces.reshape(-1, faces.shape[2])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def facets(faces: IntArray) -> IntArray:
    """Split faces (f, k) into flat polygons between neighbouring nodes, one face after the other.

    Returns
    -------
    (f·s, 4) quadrilaterals of hexahedra or (f·s, 3) triangles of tetrahedra, oriented as the faces are
    """
    pieces = _local_facets(faces.shape[1])
    return faces[:, pieces].reshape(-1, pieces.shape[1])


def outlines(faces: IntArray) -> IntArray:
    """Return the closed polygon (f, n + 1) of the nodes along the rim of each face, its first node repeated."""
    count = faces.shape[1]
    if count in (3, 6):
        rim = [0, 1, 2] if count == 3 else [0, 3, 1, 4, 2, 5]
    else:
        grid = np.arange(count).reshape(isqrt(count), -1)
        rim = [*grid[:-1, 0], *grid[-1, :-1], *grid[:0:-1, -1], *grid[0, :0:-1]]
    return faces[:, [*rim, rim[0]]]


@cache
def _local_faces(kind: ElementKind) -> IntArray:
    nodes = reference_element(kind).nodes
    if kind.startswith("tet"):
        return np.array([_with_middles(nodes, face) for face in _TETRAHEDRON_FACES])
    order = round(len(nodes) ** (1 / 3)) - 1
    grid = np.arange(len(nodes)).reshape(order + 1, order + 1, order + 1)
    faces = []
    for axis, side in product(range(3), (0, order)):
        face = grid.take(side, axis=axis)
        # The remaining axes turn about +x and +z in their order, but about −y.
        outward = (side == order) != (axis == 1)
        faces.append((face if outward else face.T).ravel())
    return np.array(faces)


def _with_middles(nodes: NDArray[np.float64], corners: tuple[int, ...]) -> list[int]:
    """Append the nodes in the middle of the edges, where the element has any."""
    found = list(corners)
    for a, b in pairwise((*corners, corners[0])):
        distance = np.linalg.norm(nodes - (nodes[a] + nodes[b]) / 2, axis=1)
        found += np.flatnonzero(distance < 1e-9).tolist()
    return found


def _local_facets(count: int) -> IntArray:
    if count == 3:
        return np.array([[0, 1, 2]])
    if count == 6:
        return np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
    grid = np.arange(count).reshape(isqrt(count), -1)
    corners = (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:])
    return np.stack([corner.ravel() for corner in corners], axis=1)
