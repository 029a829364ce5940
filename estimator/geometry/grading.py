"""How long the edges of tetrahedra should be: short where the solution is singular, on the rims of held regions."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from estimator.surfaces.surface import directed_edges

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Held faces that meet at a sharper angle than this form an edge of the held region.
_EDGE_COSINE = np.cos(np.radians(30.0))
_SAMPLES_AN_EDGE_LENGTH = 2.0


@dataclass(frozen=True, slots=True)
class Ball:
    """A place within which edges should be as short, m, as what lies in it asks for."""

    centre: tuple[float, float, float]
    radius_m: float
    edge_m: float


@dataclass(frozen=True, slots=True)
class EdgeLengths:
    """How long edges should be.

    Attributes
    ----------
    largest_m : anywhere
    rims_m : on the rim of each region; a region that is not named is not graded
    growth : by which they lengthen from there, m per m of distance
    balls : within which they are shorter; they lengthen from there as well
    """

    largest_m: float
    rims_m: Mapping[str, float] = field(default_factory=dict)
    growth: float = 0.5
    balls: tuple[Ball, ...] = ()


class EdgeLengthField:
    """The edge length that is wanted at any point.

    Parameters
    ----------
    points : (n, 3) float64, nodes of a mesh, m
    held : for each region the boundary faces (f, 3) that it holds
    lengths : what is wanted on the rims and away from them
    """

    def __init__(self, points: FloatArray, held: Mapping[str, IntArray], lengths: EdgeLengths) -> None:
        self._lengths = lengths
        self._rims = [
            (length, cKDTree(_samples(points[_rim(points, held[name])], length / _SAMPLES_AN_EDGE_LENGTH)))
            for name, length in lengths.rims_m.items()
        ]

    def __call__(self, positions: FloatArray) -> FloatArray:
        """Return the wanted edge lengths (m,) at positions (m, 3), m."""
        wanted = np.full(len(positions), self._lengths.largest_m)
        for length, rim in self._rims:
            wanted = np.minimum(wanted, length + self._lengths.growth * rim.query(positions)[0])
        for ball in self._lengths.balls:
            beyond = np.linalg.norm(positions - ball.centre, axis=1) - ball.radius_m
            wanted = np.minimum(wanted, ball.edge_m + self._lengths.growth * np.maximum(beyond, 0.0))
        return wanted


def _rim(points: FloatArray, faces: IntArray) -> IntArray:
    """Return the edges (m, 2) where a held region ends or turns."""
    a, b, c = points[faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    directed = np.sort(directed_edges(faces), axis=1)
    order = np.lexsort(directed.T)
    edges, normals = directed[order], normals[order // 3]
    shared = np.all(edges[1:] == edges[:-1], axis=1)
    flat = shared & (np.einsum("ex,ex->e", normals[1:], normals[:-1]) > _EDGE_COSINE)
    inner = np.append(flat, False) | np.append(False, flat)
    return edges[~inner]


def _samples(ends: FloatArray, spacing: float) -> FloatArray:
    """Return points (k, 3) on straight lines (m, 2, 3), no farther apart than ``spacing``."""
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max(initial=0.0)
    share = np.linspace(0.0, 1.0, int(np.ceil(length / spacing)) + 1)[:, None]
    return (ends[:, :1] + share * (ends[:, 1:] - ends[:, :1])).reshape(-1, 3)
