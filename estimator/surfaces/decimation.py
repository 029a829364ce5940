"""Fewer triangles for surfaces that have more than a mesher can use."""

import manifold3d  # type: ignore[import-not-found]  # one compiled module, without types
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from estimator.errors import InputError
from estimator.surfaces.queries import nearest
from estimator.surfaces.surface import Surface, renumbered

FloatArray = NDArray[np.float64]

MOST_TRIANGLES = 200_000
"""Surfaces of at most so many triangles are taken as they are."""

# As shares of the cube root of the volume. The mesher's envelope is 6.5e-3 at the default edge length and 4.6e-3 at
# the fine one: the surface stays well within it.
_TOLERANCES = (1e-3, 2e-3, 3e-3)
_ENOUGH = 100_000
_SAMPLES = 20_000
_NEIGHBOURS = 12


def decimated(surface: Surface, source: str) -> tuple[Surface, list[str]]:
    """Return the surface with fewer triangles if it has more than :data:`MOST_TRIANGLES`, and what was done.

    Edges are collapsed as long as the surface stays closed and moves by no more than a tolerance (Manifold,
    https://github.com/elalish/manifold). How far it has moved is measured.

    Raises
    ------
    InputError
        There are too many triangles even so, or the surface is none that can be decimated.
    """
    if len(surface.triangles) <= MOST_TRIANGLES:
        return surface, []
    size = surface.volume_m3 ** (1 / 3)
    body = _body(surface, source)
    for tolerance in _TOLERANCES:
        body = body.simplify(tolerance * size)
        if body.num_tri() <= _ENOUGH:
            break
    result = _surface(body)
    if len(result.triangles) > MOST_TRIANGLES:
        raise InputError(
            f"{source}: {len(surface.triangles)} triangles, and still {len(result.triangles)} once it is smoothed "
            f"by {_TOLERANCES[-1] * size * 1e3:.2g} mm; smooth or decimate the surface where it was made"
        )
    moved = max(_farthest(surface, result), _farthest(result, surface))
    return result, [
        f"decimated {len(surface.triangles)} triangles to {len(result.triangles)}, which moves the surface by at most "
        f"{moved * 1e3:.2g} mm and the volume by {100 * (result.volume_m3 / surface.volume_m3 - 1):+.2g} %"
    ]


def collapsed(surface: Surface, tolerance_m: float, source: str) -> Surface:
    """Return the surface with the edges collapsed that this leaves closed and moves it by no more than a tolerance.

    Raises
    ------
    InputError
        The surface is none that can be decimated.
    """
    return _surface(_body(surface, source).simplify(tolerance_m))


def _body(surface: Surface, source: str) -> manifold3d.Manifold:
    body = manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(surface.vertices), np.ascontiguousarray(surface.triangles.astype(np.uint64))
        )
    )
    if body.status() != manifold3d.Error.NoError:
        raise InputError(
            f"{source}: {len(surface.triangles)} triangles, and at most {MOST_TRIANGLES} are taken without "
            f"decimation, which fails ({body.status().name}); decimate the surface where it was made"
        )
    return body


def _surface(body: manifold3d.Manifold) -> Surface:
    mesh = body.to_mesh64()
    vertices = np.array(mesh.vert_properties, dtype=np.float64)[:, :3]
    return renumbered(vertices, np.array(mesh.tri_verts, dtype=np.int64))


def _farthest(one: Surface, other: Surface) -> float:
    """Return how far the vertices and the centres of the triangles of one lie from the other at most, m, sampled."""
    every = max(1, (len(one.vertices) + len(one.triangles)) // _SAMPLES)
    centres = one.vertices[one.triangles[::every]].mean(axis=1)
    points = np.concatenate([one.vertices[::every], centres])
    corners = other.corners
    if len(corners) > _NEIGHBOURS * len(points):
        # those around each point: building a tree of all takes longer than the query
        around = cKDTree(corners.mean(axis=1), balanced_tree=False, compact_nodes=False)
        corners = corners[np.unique(around.query(points, k=_NEIGHBOURS)[1])]
    _, foot = nearest(corners, points)
    return float(np.linalg.norm(points - foot, axis=1).max())
