"""Where and how a body is held: boxes, painted patches, rollers and the grasp. SI units, in the tissue frame."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from estimator.surfaces.formats.painting import read_painting
from estimator.surfaces.units import Unit

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]
Axis = Literal["x", "y", "z"]
AXES: tuple[Axis, ...] = get_args(Axis)

# Corners of the phantom's surface may lie beside the painting's by this share of its size.
_BESIDE_PATCH = 0.01


@dataclass(frozen=True, slots=True)
class Box:
    """An axis-aligned box given by its lower and upper corner, m; it may be flat. Its faces belong to it."""

    lower: Vector
    upper: Vector

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell for each of the points (..., 3) whether it lies in the box."""
        coordinates = np.asarray(points, dtype=np.float64)
        inside = (coordinates >= self.lower) & (coordinates <= self.upper)
        return np.asarray(inside.all(axis=-1))

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return how far each of the points (..., 3) lies from the box, m; 0 inside."""
        coordinates = np.asarray(points, dtype=np.float64)
        beyond = np.maximum(np.asarray(self.lower) - coordinates, coordinates - np.asarray(self.upper))
        return np.asarray(np.linalg.norm(np.maximum(beyond, 0.0), axis=-1))

    def overlaps_within(self, other: "Box", body: "Box") -> bool:
        """Tell whether the two boxes share a part of a third one."""
        shared = None if isinstance(other, PaintedPatch) else self.intersection(other)
        return shared is not None and shared.intersection(body) is not None

    def intersection(self, other: "Box") -> "Box | None":
        """Return what the two boxes share, None where they share nothing."""
        lower = np.maximum(self.lower, other.lower)
        upper = np.minimum(self.upper, other.upper)
        if np.any(lower > upper):
            return None
        return Box((lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2]))


@dataclass(frozen=True, slots=True)
class PaintedPatch(Box):
    """A patch of a phantom's surface, within its bounding box, m: where a painting has a value.

    Attributes
    ----------
    scalar, value : the number that is painted, and its value on the patch
    file : PLY, VTP or VTU with that number at its corners or faces
    unit : of the file; None as for the phantom's
    """

    scalar: str
    value: float
    file: Path = field(compare=False)
    unit: Unit | None = None

    @property
    def corners(self) -> FloatArray:
        """The painted points (n, 3) that have the value, m."""
        painting = read_painting(self.file, self.scalar, self.unit)
        return painting.points[painting.has(self.value)]

    @property
    def spacing(self) -> float:
        """How far these are from one another, m: the largest distance of one to the next."""
        corners = self.corners
        if len(corners) < 2:
            return 0.0
        away, _ = cKDTree(corners).query(corners, k=2)
        return float(np.max(away, initial=0.0))

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell for each of the points (..., 3) of the surface whether it lies on the patch."""
        coordinates = np.asarray(points, dtype=np.float64)
        flat = coordinates.reshape(-1, 3)
        painting = read_painting(self.file, self.scalar, self.unit)
        margin = _BESIDE_PATCH * float(np.linalg.norm(np.ptp(painting.points, axis=0)))
        near = np.all(
            (flat >= np.array(self.lower) - margin) & (flat <= np.array(self.upper) + margin), axis=1
        )
        return (near & painting.nearest_has(self.value, flat)).reshape(coordinates.shape[:-1])

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return how far each of the points (..., 3) lies from the nearest painted one, m."""
        coordinates = np.asarray(points, dtype=np.float64)
        away, _ = cKDTree(self.corners).query(coordinates.reshape(-1, 3))
        return np.asarray(away).reshape(coordinates.shape[:-1])

    def overlaps_within(self, other: Box, body: Box) -> bool:
        """Tell that it does not: a patch has no volume, and a painting one value in each place."""
        return False


@dataclass(frozen=True, slots=True)
class Roller:
    """Tissue in ``box`` does not move along some ``directions``, and slides along the others without friction.

    A plane of symmetry, a smooth plate, a lubricated platen that stands, the wall of a chamber.
    """

    box: Box
    directions: tuple[Axis, ...]


@dataclass(frozen=True, slots=True)
class Prescribed:
    """Tissue in ``box`` moves along some ``directions`` as the fiducials in it, or within ``reach`` m, were seen to.

    Mostly a face around a region of interest, followed by an image or volume correlation.
    """

    box: Box
    directions: tuple[Axis, ...]
    reach: float = 0.0


@dataclass(frozen=True, slots=True)
class Grasp:
    """Tissue in ``box`` moves with the gripper, whose frame has its origin at ``centre`` at rest, m.

    Along the axes that are not among its ``directions`` it slides on the gripper without friction, as on a lubricated
    platen.
    """

    box: Box
    centre: Vector
    directions: tuple[Axis, ...] = AXES

    @property
    def slides(self) -> bool:
        """Whether tissue slides on the gripper."""
        return len(self.directions) < len(AXES)


def along(directions: tuple[Axis, ...]) -> NDArray[np.bool_]:
    """Tell for each axis (3,) whether it is among the directions."""
    return np.array([axis in directions for axis in AXES])
