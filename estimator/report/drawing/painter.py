"""Solid bodies by the painter's algorithm: what is far is drawn first, and what turns its back is left out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from estimator.report.drawing.view import View, normals

FloatArray = NDArray[np.float64]
RGBA = tuple[float, float, float, float]


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
    seen = [face for face in faces if view.depth(normals(face.rim)) > 0]
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
