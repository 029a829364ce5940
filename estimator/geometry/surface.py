"""Closed triangulated surfaces, and what a set of triangles must fulfil to be one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from estimator.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MOST_TRIANGLES = 200_000
# A longest edge outside of this range means another unit than the metre.
_PLAUSIBLE_SIZE_M = (2e-3, 2.0)
# As shares of the longest edge: vertices closer than the first are one; a triangle flatter than the second is none.
_WELD = 1e-7
_FLAT = 1e-9


@dataclass(frozen=True)
class Surface:
    """A closed surface of one shell.

    Attributes
    ----------
    vertices : (n, 3) float64, tissue frame, m
    triangles : (t, 3) int64, anticlockwise seen from outside
    """

    vertices: FloatArray
    triangles: IntArray

    @property
    def corners(self) -> FloatArray:
        """Corners of every triangle, (t, 3, 3), m."""
        return self.vertices[self.triangles]

    @property
    def area_vectors(self) -> FloatArray:
        """Area times outward normal of every triangle, (t, 3), m²."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a) / 2

    @property
    def areas(self) -> FloatArray:
        """Area of every triangle, (t,), m²."""
        return np.linalg.norm(self.area_vectors, axis=1)

    @property
    def volume_m3(self) -> float:
        """Enclosed volume by the divergence theorem."""
        return float(np.einsum("tx,tx->", self.corners.mean(axis=1), self.area_vectors)) / 3

    @property
    def bounds(self) -> FloatArray:
        """Lower and upper corner of the bounding box, (2, 3), m."""
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @property
    def diagonal_m(self) -> float:
        """Length of the bounding box's diagonal."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))


def closed_surface(vertices: FloatArray, triangles: IntArray, source: str) -> Surface:
    """Make a closed surface of triangles: weld equal vertices, orient the triangles outward, check the rest.

    Parameters
    ----------
    vertices : (n, 3) float64, m; vertices that belong to no triangle are dropped
    triangles : (t, 3) int64, in any orientation
    source : file or maker, as messages name it

    Raises
    ------
    InputError
        There are no triangles or too many, the unit is not the metre, a triangle has no area, the surface is
        open, branches, is one-sided, or has several shells.
    """
    if not 4 <= len(triangles) <= MOST_TRIANGLES:
        raise InputError(
            f"{source}: {len(triangles)} triangles; a closed surface takes 4 to {MOST_TRIANGLES}: "
            "export it complete, or decimate it"
        )
    if not np.isfinite(vertices).all():
        raise InputError(f"{source}: a vertex is not finite; export the surface again")
    used = vertices[np.unique(triangles)]
    longest = float(np.ptp(used, axis=0).max())
    low, high = _PLAUSIBLE_SIZE_M
    if not low <= longest <= high:
        raise InputError(
            f"{source}: the surface is {longest:g} m long; export it in metres, not in millimetres"
        )
    surface = _welded(vertices, triangles, _WELD * longest)
    corners = surface.corners
    edge = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
    flat = surface.areas <= _FLAT * longest * edge
    if flat.any():
        at = corners[np.argmax(flat)].mean(axis=0)
        raise InputError(
            f"{source}: {np.count_nonzero(flat)} triangles have no area, the first {_at(at)}; "
            "remove degenerate triangles and close the surface again"
        )
    return _oriented(surface, source)


def directed_edges(triangles: IntArray) -> IntArray:
    """Return the edges (3t, 2) of triangles in their sense of rotation, those of one triangle in a row."""
    return np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)


def _welded(vertices: FloatArray, triangles: IntArray, tolerance: float) -> Surface:
    """Make one vertex of equal ones, and leave out the triangles that this makes vanish."""
    distinct, number = np.unique(vertices, axis=0, return_inverse=True)
    near = cKDTree(distinct).query_pairs(tolerance, output_type="ndarray")
    links = coo_array((np.ones(len(near)), tuple(near.T)), shape=(len(distinct), len(distinct)))
    _, group = connected_components(links, directed=False)
    merged = group[number.ravel()[triangles]].astype(np.int64)
    merged = merged[np.all(merged != np.roll(merged, 1, axis=1), axis=1)]
    first = np.unique(group, return_index=True)[1]
    kept, renumbered = np.unique(merged, return_inverse=True)
    return Surface(distinct[first[kept]], renumbered.reshape(-1, 3))


def _oriented(surface: Surface, source: str) -> Surface:
    """Turn triangles until neighbours agree and normals look outward.

    Every triangle stands twice in a graph, as it is and turned over, and is linked to those versions of its
    neighbours that agree with it. One two-sided shell then falls into two components.
    """
    directed = directed_edges(surface.triangles)
    first, second = _neighbours(surface, source)
    agree = directed[first, 0] == directed[second, 1]
    count = len(surface.triangles)
    a, b = first // 3, np.where(agree, second // 3, second // 3 + count)
    ends = np.concatenate([a, a + count]), np.concatenate([b, (b + count) % (2 * count)])
    links = coo_array((np.ones(2 * len(a)), ends), shape=(2 * count, 2 * count))
    parts, part = connected_components(links, directed=False)
    if np.any(part[:count] == part[count:]):
        raise InputError(f"{source}: the surface is one-sided; repair it to one closed shell")
    if parts > 2:
        raise InputError(f"{source}: the surface has {parts // 2} separate shells; keep one of them")
    turned = part[:count] != part[0]
    triangles = np.where(turned[:, None], surface.triangles[:, ::-1], surface.triangles)
    oriented = Surface(surface.vertices, triangles)
    if abs(oriented.volume_m3) <= _FLAT * oriented.diagonal_m**3:
        raise InputError(f"{source}: the surface encloses nothing; repair it to one closed shell")
    return oriented if oriented.volume_m3 > 0 else Surface(surface.vertices, triangles[:, ::-1].copy())


def _neighbours(surface: Surface, source: str) -> tuple[IntArray, IntArray]:
    """Return the pairs of directed edges that are one edge of the surface."""
    edges = np.sort(directed_edges(surface.triangles), axis=1)
    unique, number, uses = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    for wrong, fault in ((uses == 1, "is open at"), (uses > 2, "branches at")):
        if wrong.any():
            at = surface.vertices[unique[np.argmax(wrong)]].mean(axis=0)
            raise InputError(
                f"{source}: the surface {fault} {np.count_nonzero(wrong)} edges, the first {_at(at)}; "
                "repair it to one closed shell"
            )
    first, second = np.argsort(number.ravel(), kind="stable").reshape(-1, 2).T
    return first, second


def _at(point: FloatArray) -> str:
    return f"near {np.round(point * 1e3, 2).tolist()} mm"
