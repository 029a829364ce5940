"""Beads spread over a surface, for phantoms that have none yet."""

import numpy as np
from numpy.typing import NDArray

from estimator.surfaces.queries import inside
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

# Beads sit where cameras above see the surface: its normal rises by more than this, the sine of an angle.
_SEEN_FROM_ABOVE = 0.5
_STEPS_UP = 24


def spread_beads(surface: Surface, count: int) -> FloatArray:
    """Return places (count, 3) for beads on the upper side of a surface, far from each other, m.

    Each is put where it is farthest from those before it (T. Gonzalez, 1985), the first one on top.
    """
    normals = surface.area_vectors / surface.areas[:, None]
    seen = surface.corners.mean(axis=1)[normals[:, 2] > _SEEN_FROM_ABOVE]
    seen = seen[_free_above(surface, seen)]
    chosen = [int(np.argmax(seen[:, 2]))][:count]
    away = np.full(len(seen), np.inf)
    while len(chosen) < min(count, len(seen)):
        away = np.minimum(away, np.linalg.norm(seen - seen[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(away)))
    return seen[chosen]


def _free_above(surface: Surface, points: FloatArray) -> NDArray[np.bool_]:
    """Tell for points (m, 3) of a surface whether no tissue lies above them, as it does above a cavity."""
    share = (np.arange(_STEPS_UP) + 0.5) / _STEPS_UP
    above = np.repeat(points[:, None], _STEPS_UP, axis=1)
    above[..., 2] += share * (surface.bounds[1, 2] - points[:, None, 2])
    return np.asarray(~inside(surface, above.reshape(-1, 3)).reshape(-1, _STEPS_UP).any(axis=1))
