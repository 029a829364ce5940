"""Linear tetrahedra with the nodes of our quadratic elements: MuJoCo's flexes have no others."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.fem.discretisation.mesh import Mesh

IntArray = NDArray[np.int64]

_OURS = {place: number for number, place in enumerate(product(range(3), repeat=3))}
# The four at the corners, and four about the diagonal from the middle of edge 01 to that of edge 23.
_OF_TETRAHEDRON = (
    *((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)),
    *((4, 9, 5, 6), (4, 9, 6, 7), (4, 9, 7, 8), (4, 9, 8, 5)),
)


def linear_tetrahedra(mesh: Mesh) -> IntArray:
    """Return tetrahedra (t, 4) of a mesh's nodes, all with a positive volume.

    A hexahedron of 27 nodes is eight of 8 nodes; each becomes six tetrahedra about its diagonal (Kuhn's, which agree
    on the faces between hexahedra that lie alike).

    Raises
    ------
    InputError
        The mesh has other elements.
    """
    if mesh.kind not in ("hex27", "tet10"):
        raise InputError(f"MuJoCo takes hex27 and tet10, not {mesh.kind}")
    local = np.array(_of_hexahedron() if mesh.kind == "hex27" else _OF_TETRAHEDRON)
    cells = mesh.cells[:, local].reshape(-1, 4)
    a, b, c, d = np.moveaxis(mesh.points[cells], 1, 0)
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    return cells


def _of_hexahedron() -> list[tuple[int, ...]]:
    found = []
    for start in product(range(2), repeat=3):
        for order in permutations(range(3)):
            place, path = list(start), [_OURS[start]]
            for axis in order:
                place[axis] += 1
                path.append(_OURS[place[0], place[1], place[2]])
            found.append(tuple(path))
    return found
