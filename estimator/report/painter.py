"""Solid bodies by the painter's algorithm: what is far is drawn first, and what turns its back is left out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
RGBA = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class View:
    """A parallel projection: the reader looks from an azimuth about z, measured from x, and an elevation."""

    azimuth_deg: float
    elevation_deg: float

    def project(self, points: FloatArray) -> FloatArray:
        """Return coordinates (..., 2), to the right and up, of points (..., 3)."""
        return points @ self._axes()[:2].T

    def depth(self, points: FloatArray) -> FloatArray:
        """Return how near points (..., 3) are to the reader, (...)."""
        return points @ self._axes()[2]

    def _axes(self) -> FloatArray:
        azimuth, elevation = np.radians([self.azimuth_deg, self.elevation_deg])
        right = [-np.sin(azimuth), np.cos(azimuth), 0.0]
        towards = [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
        return np.array([right, np.cross(towards, right), towards])


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A face of a body, curved if it has several pieces.

    Attributes
    ----------
    rim : (k, 3) corners, anticlockwise seen from outside
    pieces : (s, j, 3) flat polygons that make up the face
    colours : (s, 4) of the pieces, red, green, blue and opacity from 0 to 1
    rim_colour : of the line around the face; opacity 0 for none
    """

    rim: FloatArray
    pieces: FloatArray
    colours: FloatArray
    rim_colour: RGBA


def paint(axes: Axes, view: View, faces: Sequence[Face]) -> None:
    """Draw the faces that turn their outside to the reader, those far away first."""
    seen = [face for face in faces if view.depth(_normal(face.rim)) > 0]
    seen.sort(key=lambda face: float(view.depth(face.rim.mean(axis=0))))
    polygons: list[FloatArray] = []
    insides: list[FloatArray] = []
    rims: list[FloatArray] = []
    for face in seen:
        polygons += [*view.project(face.pieces), view.project(face.rim)]
        insides += [face.colours, np.zeros((1, 4))]
        rims += [face.colours, np.array([face.rim_colour])]
    axes.add_collection(
        PolyCollection(
            polygons,
            facecolors=np.concatenate(insides),
            edgecolors=np.concatenate(rims),
            linewidths=0.5,
            rasterized=True,
        )
    )


def _normal(corners: FloatArray) -> FloatArray:
    return np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
