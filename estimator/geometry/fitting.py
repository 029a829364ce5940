"""Moves the boundary of a mesh onto the surface that it stands for.

The mesher leaves its nodes within an envelope around the surface, and bisection puts new ones on chords.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.holds import HeldSurface
from estimator.geometry.quality import tetrahedron_volumes
from estimator.surfaces.queries import nearest

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# A move that leaves a tetrahedron less than this share of its volume is not made.
_LEAST_VOLUME = 0.7
# Projections onto surface and wall in turn, which lead to the rim between them.
_ALTERNATIONS = 8


def fitted(
    points: FloatArray, cells: IntArray, free: IntArray, held: Mapping[str, IntArray], body: HeldSurface
) -> FloatArray:
    """Return the nodes (n, 3), m, with those of the boundary moved onto the surface and the walls of the regions.

    Parameters
    ----------
    points : (n, 3) float64, m
    cells : (e, 4) int64
    free, held : boundary faces (f, 3) that nothing holds, and those that each region holds
    body : that was meshed
    """
    moved = points.copy()
    outer = np.unique(free)
    _, moved[outer] = nearest(body.surface.corners, points[outer])
    for name, hold in body.holds.items():
        nodes = np.unique(held[name])
        if hold.core is None:
            _, moved[nodes] = nearest(body.surface.corners[hold.patch], points[nodes])
        else:
            _, moved[nodes] = nearest(hold.walls, points[nodes])
        rim = np.intersect1d(outer, nodes)
        for _ in range(_ALTERNATIONS):
            _, moved[rim] = nearest(body.surface.corners, moved[rim])
            _, moved[rim] = nearest(hold.walls, moved[rim])
    before = tetrahedron_volumes(points[cells])
    while np.any(bad := tetrahedron_volumes(moved[cells]) < _LEAST_VOLUME * before):
        stuck = np.unique(cells[bad])
        moved[stuck] = points[stuck]
    return moved
