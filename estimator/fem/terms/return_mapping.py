"""What a spring that yields is stretched by: the return mapping of dry friction in a plane.

A node sticks to a point of the surface on which it rubs by a spring. Once that has reached what friction bears it
stretches no further, and drags the point along (Wriggers, Computational Contact Mechanics, 2006, section 10.5.2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Stretched:
    """Springs between nodes and the points that they stick to.

    Attributes
    ----------
    stretch : (n, 2) from the points to the nodes, m
    share : (n,) of it that is elastic
    sliding : (n,) bool, whether the rest has slid
    """

    stretch: FloatArray
    share: FloatArray
    sliding: BoolArray

    @property
    def direction(self) -> FloatArray:
        """In which those slide that do, unit vectors (s, 2)."""
        moved = self.stretch[self.sliding]
        return np.asarray(moved / np.linalg.norm(moved, axis=1, keepdims=True))

    @property
    def slip(self) -> FloatArray:
        """How far the points are dragged along, (n, 2), m."""
        return np.asarray((1.0 - self.share)[:, None] * self.stretch)


def stretched(place: FloatArray, point: FloatArray, reach: FloatArray | float) -> Stretched:
    """Return how springs from points (n, 2) to places (n, 2), m, are stretched, which yield at ``reach`` (n,), m.

    Examples
    --------
    >>> import numpy as np
    >>> found = stretched(np.array([[3e-3, 4e-3]]), np.zeros((1, 2)), 1e-3)
    >>> round(float(found.share[0]), 3), found.direction.round(2).tolist()
    (0.2, [[0.6, 0.8]])
    """
    stretch = place - point
    length = np.linalg.norm(stretch, axis=1)
    limit = np.broadcast_to(np.asarray(reach, dtype=np.float64), length.shape)
    sliding = length > limit
    share: FloatArray = np.ones(len(length))
    share[sliding] = limit[sliding] / length[sliding]
    return Stretched(stretch, share, sliding)
