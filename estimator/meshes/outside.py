"""The closed surface of a volume mesh, or of a region of it."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimator.meshes.volume_mesh import CellKind, VolumeMesh
from estimator.surfaces.formats.soup import PolygonSoup
from estimator.surfaces.repair import RepairedSurface, repaired

IntArray = NDArray[np.int64]

# Corners of the faces of each kind, anticlockwise seen from outside; a triangle repeats its last one.
_TETRAHEDRON = ((1, 2, 3, 3), (0, 3, 2, 2), (0, 1, 3, 3), (0, 2, 1, 1))
_FACES: Mapping[CellKind, tuple[tuple[int, int, int, int], ...]] = {
    "tet4": _TETRAHEDRON,
    "tet10": _TETRAHEDRON,
    "pyramid5": ((0, 3, 2, 1), (0, 1, 4, 4), (1, 2, 4, 4), (2, 3, 4, 4), (3, 0, 4, 4)),
    "wedge6": ((0, 2, 1, 1), (3, 4, 5, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hex8": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}


def outer_surface(mesh: VolumeMesh, source: str, region: str | None = None) -> RepairedSurface:
    """Return the surface of a mesh, or of one of its regions, m; faces are flat between their corners.

    Raises
    ------
    InputError
        The elements are no one body, or touch themselves along an edge.
    """
    faces = []
    for kind, cells in mesh.blocks.items():
        chosen = cells if region is None else cells[mesh.members(region, kind)]
        faces.append(chosen[:, np.array(_FACES[kind])].reshape(-1, 4))
    every = np.concatenate(faces)
    _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    outer = every[first[count == 1]]
    corners = np.where(outer[:, 2] == outer[:, 3], 3, 4)
    nodes = outer[np.arange(4) < corners[:, None]]
    return repaired(PolygonSoup(mesh.points, nodes, np.cumsum(corners)), source, "m")
