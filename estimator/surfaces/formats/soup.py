"""What a file of a surface holds: vertices and polygons, as they stand there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PolygonSoup:
    """Polygons of any number of corners that need not fit together.

    Attributes
    ----------
    vertices : (n, 3) float64, in the file's unit
    nodes : (k,) int64, vertex numbers from 0 of the corners of all polygons, one polygon after the other
    ends : (p,) int64, place in ``nodes`` behind the last corner of each polygon
    shares_vertices : whether the format lets polygons share vertices; an STL file repeats them
    remarks : what was found in the file that a reader has to know of, and what was made of it
    """

    vertices: FloatArray
    nodes: IntArray
    ends: IntArray
    shares_vertices: bool = True
    remarks: tuple[str, ...] = ()


def soup_of_corners(corners: FloatArray, remarks: tuple[str, ...] = ()) -> PolygonSoup:
    """Return the soup of triangles given by their corners, (t, 3, 3)."""
    count = 3 * len(corners)
    ends = np.arange(3, count + 1, 3, dtype=np.int64)
    return PolygonSoup(corners.reshape(-1, 3), np.arange(count), ends, shares_vertices=False, remarks=remarks)


def soup_of_triangles(vertices: FloatArray, triangles: IntArray) -> PolygonSoup:
    """Return the soup of triangles (t, 3) that name vertices (n, 3)."""
    ends = np.arange(3, triangles.size + 1, 3, dtype=np.int64)
    return PolygonSoup(vertices, triangles.reshape(-1).astype(np.int64), ends)


def triangles_of_strip(strip: ArrayLike) -> IntArray:
    """Return the triangles (s - 2, 3) of a strip (s,) of vertices, every other one turned over so that all agree."""
    nodes = np.asarray(strip, dtype=np.int64)
    triangles = np.stack([nodes[:-2], nodes[1:-1], nodes[2:]], axis=1) if len(nodes) > 2 else np.empty((0, 3))
    triangles[1::2] = triangles[1::2, ::-1]
    return triangles.astype(np.int64)


def joined(parts: Sequence[tuple[IntArray, IntArray]]) -> tuple[IntArray, IntArray]:
    """Return nodes and ends of several sets of polygons, one after the other."""
    nodes = [np.empty(0, np.int64), *(nodes for nodes, _ in parts)]
    starts = np.cumsum([len(part) for part in nodes])
    ends = [np.empty(0, np.int64), *(ends + start for (_, ends), start in zip(parts, starts, strict=False))]
    return np.concatenate(nodes), np.concatenate(ends)
