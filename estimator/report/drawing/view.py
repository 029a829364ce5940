"""From where a reader looks at a body, and which of its faces turn to him."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


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

    def right(self) -> FloatArray:
        """Return the direction (3,) that lies to the reader's right."""
        return self._axes()[0]

    def _axes(self) -> FloatArray:
        azimuth, elevation = np.radians([self.azimuth_deg, self.elevation_deg])
        right = [-np.sin(azimuth), np.cos(azimuth), 0.0]
        towards = [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
        return np.array([right, np.cross(towards, right), towards])


def normals(corners: FloatArray) -> FloatArray:
    """Return the normals (..., 3), by the right-hand rule and of any length, of polygons (..., k, 3)."""
    return np.cross(corners, np.roll(corners, -1, axis=-2)).sum(axis=-2)
