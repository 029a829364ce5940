"""Closed triangulated surfaces of bodies, which may have cavities."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Surface:
    """The closed surface of one body: its outer shell, and one more around each cavity in it.

    Attributes
    ----------
    vertices : (n, 3) float64, tissue frame, m
    triangles : (t, 3) int64, anticlockwise seen from outside of the tissue
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
        """Volume of the tissue by the divergence theorem; cavities do not count."""
        # about a vertex: far from the origin the products would cancel
        centroids = self.corners.mean(axis=1) - self.vertices[0]
        return float(np.einsum("tx,tx->", centroids, self.area_vectors)) / 3

    @property
    def bounds(self) -> FloatArray:
        """Lower and upper corner of the bounding box, (2, 3), m."""
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @property
    def diagonal_m(self) -> float:
        """Length of the bounding box's diagonal."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))


def directed_edges(triangles: IntArray) -> IntArray:
    """Return the edges (3t, 2) of triangles in their sense of rotation, those of one triangle in a row."""
    return np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)


def used_vertices(nodes: IntArray, count: int) -> IntArray:
    """Return which of ``count`` vertices occur among ``nodes``, ascending."""
    # np.unique hashes whole numbers, which takes many times as long
    used = np.zeros(count, dtype=bool)
    used[nodes] = True
    return np.flatnonzero(used)


def renumbered(vertices: FloatArray, triangles: IntArray) -> Surface:
    """Return the surface without the vertices that no triangle uses."""
    kept = used_vertices(triangles, len(vertices))
    number = np.empty(len(vertices), dtype=np.int64)
    number[kept] = np.arange(len(kept))
    return Surface(vertices[kept], number[triangles])
