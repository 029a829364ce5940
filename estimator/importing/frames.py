"""From the source's axes to the tissue frame: an origin, and which axis points where."""

import re
from dataclasses import dataclass

import numpy as np

from estimator.errors import InputError
from estimator.importing.table import FloatArray

_AXIS = re.compile(r"([+-]?)([xyz])")
_RIGHT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class SourceFrame:
    """The source's frame in the tissue frame.

    Attributes
    ----------
    R_tissue_source : (3, 3), its rows are the tissue axes in the source's; orthonormal and right-handed
    origin : (3,) phantom's centre at rest in the source's frame, m
    """

    R_tissue_source: FloatArray
    origin: FloatArray

    def points(self, points: FloatArray) -> FloatArray:
        """Return points (..., 3) in the tissue frame; where a coordinate is not known, those that need it are not."""
        return self.vectors(points - self.origin)

    def vectors(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (..., 3) along the tissue axes; NaN where a component that is needed is."""
        used = np.abs(self.R_tissue_source) > _RIGHT
        known = np.isfinite(vectors)
        rotated = np.where(known, vectors, 0.0) @ self.R_tissue_source.T
        missing = ~known[..., None, :] & used
        return np.asarray(np.where(missing.any(axis=-1), np.nan, rotated))


def rotation_of_axes(axes: object, where: str) -> FloatArray:
    """Return the rotation of ``["x", "-z", "y"]``, the tissue's x, y, z in the source's axes, or of nine numbers.

    Raises
    ------
    InputError
        They are no three axes, or left-handed: a mirror image, which no turning of a body makes.
    """
    rotation = _matrix(axes, where)
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6):
        raise InputError(f"{where}: {axes!r} are not at right angles; name each of x, y, z once")
    if np.linalg.det(rotation) < 0:
        raise InputError(
            f"{where}: {axes!r} is left-handed, a mirror image; turn one sign over (an image's y points down, "
            'its z away from the camera: ["x", "-y", "-z"])'
        )
    return rotation


def _matrix(axes: object, where: str) -> FloatArray:
    if not isinstance(axes, list) or len(axes) != 3:
        raise InputError(f'{where}: is {axes!r}; write three axes, ["x", "y", "z"]')
    if all(isinstance(axis, str) for axis in axes):
        rotation = np.zeros((3, 3))
        for row, axis in enumerate(axes):
            match = _AXIS.fullmatch(axis.strip().lower())
            if match is None:
                raise InputError(f"{where}: {axis!r} is no axis; write x, y or z, with - for the other way")
            rotation[row, "xyz".index(match[2])] = -1.0 if match[1] == "-" else 1.0
        return rotation
    try:
        matrix = np.array(axes, dtype=np.float64)
    except (ValueError, TypeError):
        matrix = np.zeros(0)
    if matrix.shape != (3, 3):
        raise InputError(f"{where}: is {axes!r}; write three axes, or three rows of three numbers")
    return matrix
