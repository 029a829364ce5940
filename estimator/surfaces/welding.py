"""Makes one vertex of equal ones, so that polygons that meet share their corners."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Rows = TypeVar("Rows", FloatArray, IntArray)


def weld(vertices: FloatArray, tolerance: float) -> tuple[FloatArray, IntArray]:
    """Return the distinct ones (m, 3) of vertices (n, 3), and which of them each has become, (n,).

    Vertices closer than ``tolerance``, and those linked by such ones, are one; it stays where one of them was.
    """
    distinct, number = distinct_rows(vertices)
    near = cKDTree(distinct).query_pairs(tolerance, output_type="ndarray")
    if not len(near):
        return distinct, number
    links = coo_array((np.ones(len(near)), tuple(near.T)), shape=(len(distinct), len(distinct)))
    _, group = connected_components(links, directed=False)
    first = np.unique(group, return_index=True)[1]
    return distinct[first], group.astype(np.int64)[number]


def distinct_rows(rows: Rows) -> tuple[Rows, IntArray]:
    """Return rows (n, c) sorted and without repetition, and which of them each one is, (n,)."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.ones(len(rows), dtype=bool)
    new[1:] = np.any(ordered[1:] != ordered[:-1], axis=1)
    number = np.empty(len(rows), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    return ordered[new], number
