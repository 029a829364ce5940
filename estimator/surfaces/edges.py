"""Edges of triangles, and how many triangles meet at each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.surfaces.surface import directed_edges

IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of triangles.

    Attributes
    ----------
    keys : (e,) int64, ascending, one number for each edge
    uses : (e,) int64, how many triangles have it
    order : (3t,) int64, the directed edges of the triangles (three in a row are of one) in the order of the keys
    starts : (e,) int64, where in ``order`` those of each edge begin
    """

    keys: IntArray
    uses: IntArray
    order: IntArray
    starts: IntArray
    _span: int

    def number(self, first: int, second: int) -> int | None:
        """Return the number of the edge between two vertices, None where there is none."""
        key = min(first, second) * self._span + max(first, second)
        place = int(np.searchsorted(self.keys, key))
        return place if place < len(self.keys) and self.keys[place] == key else None

    def triangles_at(self, edge: int) -> IntArray:
        """Return the numbers of the triangles that have an edge."""
        return self.order[self.starts[edge] : self.starts[edge] + self.uses[edge]] // 3

    def ends(self, edges: IntArray) -> IntArray:
        """Return the two vertices (m, 2) of edges (m,)."""
        return np.stack(np.divmod(self.keys[edges], self._span), axis=-1)


def edges_of(triangles: IntArray) -> Edges:
    """Return the edges of triangles (t, 3)."""
    span = int(triangles.max(initial=0)) + 1
    low, high = np.sort(directed_edges(triangles), axis=1).T
    key = low * span + high
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    starts = np.flatnonzero(np.diff(ordered, prepend=-1))
    uses = np.diff(np.append(starts, len(ordered)))
    return Edges(ordered[starts], uses, order, starts, span)
