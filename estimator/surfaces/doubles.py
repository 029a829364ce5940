"""Triangles that stand several times in a file."""

import numpy as np
from numpy.typing import NDArray

from estimator.surfaces.edges import edges_of
from estimator.surfaces.welding import distinct_rows

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def without_doubles(triangles: IntArray) -> tuple[IntArray, int]:
    """Return the triangles (t, 3) without repetition, and how many were left out.

    Of triangles with the same corners the first is kept. Where that leaves a sheet of no thickness standing on the
    surface, which two triangles back to back are, both of them go.
    """
    _, group = distinct_rows(np.sort(triangles, axis=1))
    _, first, count = np.unique(group, return_index=True, return_counts=True)
    if len(first) == len(triangles):
        return triangles, 0
    kept = np.zeros(len(triangles), dtype=bool)
    kept[first] = True
    paired = kept & (count == 2)[group]
    once = triangles[kept]
    if np.all(edges_of(once).uses == 2):
        return once, len(triangles) - len(once)
    without_sheets = triangles[kept & ~(paired & _on_sheets(triangles, kept, paired))]
    return without_sheets, len(triangles) - len(without_sheets)


def _on_sheets(triangles: IntArray, kept: BoolArray, paired: BoolArray) -> BoolArray:
    """Tell which of the ``paired`` triangles (t,) no edge misses: none or two that stand once meet at each edge."""
    rest = edges_of(triangles[kept & ~paired])
    uses = np.ones((len(triangles), 3), dtype=np.int64)
    for number in np.flatnonzero(paired):
        for side in range(3):
            edge = rest.number(int(triangles[number, side]), int(triangles[number, (side + 1) % 3]))
            uses[number, side] = 0 if edge is None else rest.uses[edge]
    return np.asarray(np.all(uses % 2 == 0, axis=1))
