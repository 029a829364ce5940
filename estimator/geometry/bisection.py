"""Local refinement of tetrahedra by bisecting longest edges.

A marked tetrahedron is bisected at its longest edge together with all that share this edge. Where the edge is not the
longest of one of those, that one is bisected first; so the mesh conforms at every moment (M.-C. Rivara, "New
longest-edge algorithms for the refinement and/or improvement of unstructured triangulations", Int. J. Numer. Meth.
Engng 40 (1997), carried over to three dimensions).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

TETRAHEDRON_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])


def refine(
    points: FloatArray, cells: IntArray, wanted_m: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, IntArray]:
    """Bisect tetrahedra until none has an edge much longer than wanted.

    Parameters
    ----------
    points : (n, 3) float64, m
    cells : (e, 4) int64
    wanted_m : returns the edge lengths (k,) that are aimed at for points (k, 3), m

    Returns
    -------
    points, cells : the refined mesh, in the orientation of the given one
    """
    while True:
        edges = _number_edges(points, cells)
        longest = edges.longest
        middle = points[edges.ends].mean(axis=1)
        # Bisection halves a length, so that between √2 and 1/√2 of the aim is as near as it comes.
        long = edges.length > np.sqrt(2.0) * wanted_m(middle)
        marked = np.unique(longest[long[longest]])
        if not len(marked):
            return points, cells
        bisected = _bisectable(edges, longest, marked)
        new = np.where(bisected, len(points) + np.cumsum(bisected) - 1, -1)
        points = np.vstack([points, middle[bisected]])
        split = bisected[longest]
        local = np.argmax(edges.of_cell[split] == longest[split, None], axis=1)
        halves = []
        for end in range(2):
            half = cells[split]
            half[np.arange(len(half)), TETRAHEDRON_EDGES[local, end]] = new[longest[split]]
            halves.append(half)
        cells = np.concatenate([cells[~split], *halves])


@dataclass(frozen=True)
class _Edges:
    """The distinct edges of a mesh: their ends (k, 2), lengths (k,), numbers in each cell (e, 6), longest (e,)."""

    ends: IntArray
    length: FloatArray
    of_cell: IntArray
    longest: IntArray


def _number_edges(points: FloatArray, cells: IntArray) -> _Edges:
    ends = np.sort(cells[:, TETRAHEDRON_EDGES], axis=2).reshape(-1, 2)
    key, of_cell = np.unique(ends[:, 0] * len(points) + ends[:, 1], return_inverse=True)
    distinct = np.stack(np.divmod(key, len(points)), axis=1)
    length = np.linalg.norm(points[distinct[:, 1]] - points[distinct[:, 0]], axis=1)
    of_cell = of_cell.reshape(-1, 6)
    # A strict order, the same for all cells, breaks ties; else the propagation could go in circles.
    rank = np.empty(len(key), dtype=np.int64)
    rank[np.argsort(length, kind="stable")] = np.arange(len(key))
    longest = np.take_along_axis(of_cell, np.argmax(rank[of_cell], axis=1)[:, None], axis=1)[:, 0]
    return _Edges(distinct, length, of_cell, longest)


def _bisectable(edges: _Edges, longest: IntArray, marked: IntArray) -> BoolArray:
    """Follow the marked edges to ever longer ones, and return those (k,) that are the longest of all their cells."""
    reached = np.zeros(len(edges.length), dtype=bool)
    reached[marked] = True
    before = -1
    while (count := int(np.count_nonzero(reached))) > before:
        before = count
        reached[longest[reached[edges.of_cell].any(axis=1)]] = True
    cells_of = np.bincount(edges.of_cell.ravel(), minlength=len(reached))
    return reached & (cells_of == np.bincount(longest, minlength=len(reached)))
