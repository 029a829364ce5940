"""Sorting by small whole numbers, in two sweeps over the data: a million keys a core in some hundredths of a second."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

IntArray = NDArray[np.int64]


def order_by(first: IntArray, then: IntArray, count: int) -> IntArray:
    """Return the order (n,) in which two keys (n,) ascend, the first one before the other.

    Parameters
    ----------
    first, then : (n,) int64, from 0 to ``count`` - 1

    Examples
    --------
    >>> order_by(np.array([1, 0, 1]), np.array([0, 2, 0]), 3)
    array([1, 0, 2])
    """
    return _stable(first, _stable(then, np.arange(len(then)), count), count)


@njit(cache=True)
def _stable(keys: IntArray, order: IntArray, count: int) -> IntArray:
    """Return the order with equal keys left in it as they were (counting sort)."""
    place = np.zeros(count + 1, dtype=np.int64)
    for key in keys:
        place[key + 1] += 1
    for key in range(count):
        place[key + 1] += place[key]
    out = np.empty(len(order), dtype=np.int64)
    for item in order:
        key = keys[item]
        out[place[key]] = item
        place[key] += 1
    return out
