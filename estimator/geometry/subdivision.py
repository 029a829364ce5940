"""Uniform refinement: every tetrahedron into eight.

Four stand at its corners; the octahedron between them is cut along the shortest of its diagonals, which keeps the
angles from becoming small (J. Bey, "Tetrahedral grid refinement", Computing 55 (1995) 355).
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Nodes of a tetrahedron of second order: its corners 0 to 3, then the middles of 01, 12, 02, 03, 13 and 23.
_AT_CORNERS = ((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3))
# Ends of each diagonal of the octahedron of the middles, and the others in their order around it.
_DIAGONALS = (((4, 9), (5, 6, 7, 8)), ((5, 7), (4, 8, 9, 6)), ((6, 8), (4, 5, 9, 7)))


def halved_cells(points: FloatArray, cells: IntArray) -> IntArray:
    """Return the tetrahedra (8e, 4) of half the size that have the nodes of those of second order for their corners.

    Parameters
    ----------
    points : (n, 3) float64, m
    cells : (e, 10) int64, positively oriented; the new ones are, too
    """
    ends = np.array([diagonal for diagonal, _ in _DIAGONALS])
    along = points[cells[:, ends[:, 0]]] - points[cells[:, ends[:, 1]]]
    shortest = np.linalg.norm(along, axis=2).argmin(axis=1)
    parts = [cells[:, list(corner)] for corner in _AT_CORNERS]
    for number, ((start, end), around) in enumerate(_DIAGONALS):
        cut = cells[shortest == number]
        parts += [cut[:, [start, end, a, b]] for a, b in zip(around, np.roll(around, -1), strict=True)]
    return np.concatenate(parts)
