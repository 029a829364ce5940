"""An order of elimination in which the Cholesky factor of a large mesh fills little: nested dissection.

The mesh is cut in two across its longest side; the nodes of one part that share an element with the other separate them
and are eliminated last, for no entry of the factor then joins the two parts. Each part is cut in the same way (A.
George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10 (1973) 345-363).

>>> import numpy as np
>>> line = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5)])
>>> nested_dissection(line, np.array([[0, 1], [1, 2], [2, 3], [3, 4]]), leaf=2)
array([0, 3, 4, 2, 1])
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def nested_dissection(points: FloatArray, cells: IntArray, leaf: int = 24) -> IntArray:
    """Return the nodes (n,) in their order of elimination.

    Parameters
    ----------
    points : (n, 3) float64, m
    cells : (e, k) int64, nodes of each element
    leaf : of so many nodes no part is cut
    """
    graph = _neighbours(cells, len(points))
    return np.concatenate(list(_dissected(np.arange(len(points)), points, graph, leaf)))


def _neighbours(cells: IntArray, nodes: int) -> csr_array:
    """Return which nodes share an element, as a matrix (n, n)."""
    elements, corners = cells.shape
    member = csr_array(
        (np.ones(cells.size, dtype=np.float32), cells.ravel(), np.arange(0, cells.size + 1, corners)),
        shape=(elements, nodes),
    )
    return csr_array(member.T @ member)


def _dissected(part: IntArray, points: FloatArray, graph: csr_array, leaf: int) -> Iterator[IntArray]:
    """Yield a part's nodes in their order of elimination."""
    first = _first_half(points[part]) if len(part) > leaf else None
    if first is None or first.all():
        yield part
        return
    one, other = part[first], part[~first]
    between, behind = _beside(one, other, graph), _beside(other, one, graph)
    if between.sum() <= behind.sum():
        one, separator = one[~between], one[between]
    else:
        other, separator = other[~behind], other[behind]
    yield from _dissected(one, points, graph, leaf)
    yield from _dissected(other, points, graph, leaf)
    yield separator


def _beside(nodes: IntArray, others: IntArray, graph: csr_array) -> NDArray[np.bool_]:
    """Tell which of some nodes share an element with any of the others."""
    among = np.zeros(graph.shape[0], dtype=np.float32)
    among[others] = 1.0
    return np.asarray(graph[nodes] @ among > 0.0)


def _first_half(points: FloatArray) -> NDArray[np.bool_]:
    """Tell which points (n, 3) are before the middle along their longest extent; all of them where they are one."""
    along = points[:, int(np.argmax(np.ptp(points, axis=0)))]
    # Nodes in one plane stay together: half of them on either side would make both sides of the cut ragged.
    middle = np.median(along)
    return np.asarray(along < middle if middle > along.min() else along <= middle)
