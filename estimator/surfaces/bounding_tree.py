"""A tree of bounding boxes over triangles, so that a query looks at few of them."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_LEAF = 6


@dataclass(frozen=True, eq=False)
class BoundingTree:
    """Nodes that hold runs of the triangles; the children of a node halve its run.

    Attributes
    ----------
    order : (t,) int64, the triangles in the order of the runs
    first, last : (m,) int64, the run of each node, without its end
    child : (m,) int64, the first of the two children of each node, which follow one another; -1 for a leaf
    lower, upper : (m, 3) float64, bounding boxes, m
    """

    order: IntArray
    first: IntArray
    last: IntArray
    child: IntArray
    lower: FloatArray
    upper: FloatArray


def bounding_tree(corners: FloatArray) -> BoundingTree:
    """Return the tree of triangles (t, 3, 3), m."""
    return BoundingTree(
        *_build(np.ascontiguousarray(corners.mean(axis=1)), corners.min(axis=1), corners.max(axis=1))
    )


@njit(cache=True)
def _build(
    centres: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[IntArray, IntArray, IntArray, IntArray, FloatArray, FloatArray]:
    count = len(centres)
    most = 4 * (count // _LEAF + 1)
    order = np.arange(count)
    first, last = np.zeros(most, np.int64), np.zeros(most, np.int64)
    child = np.full(most, -1, np.int64)
    lower, upper = np.full((most, 3), np.inf), np.full((most, 3), -np.inf)
    last[0], nodes, node = count, 1, 0
    while node < nodes:
        begin, end = first[node], last[node]
        axis, widest = 0, -1.0
        for x in range(3):
            least, most_x = np.inf, -np.inf
            for place in range(begin, end):
                t = order[place]
                lower[node, x] = min(lower[node, x], low[t, x])
                upper[node, x] = max(upper[node, x], high[t, x])
                least, most_x = min(least, centres[t, x]), max(most_x, centres[t, x])
            if most_x - least > widest:
                axis, widest = x, most_x - least
        if end - begin > _LEAF:
            run = order[begin:end].copy()
            order[begin:end] = run[np.argsort(centres[run, axis])]
            middle = (begin + end) // 2
            child[node] = nodes
            first[nodes], last[nodes] = begin, middle
            first[nodes + 1], last[nodes + 1] = middle, end
            nodes += 2
        node += 1
    return order, first[:nodes], last[:nodes], child[:nodes], lower[:nodes], upper[:nodes]
