"""Where the phantom is held: tissue in a box, or a patch of its surface, made ready for a mesher.

A mesher keeps what it cannot move: where surfaces meet at an angle. So tissue in a box is cut away along walls, which
are faces of the box that reach beyond the surface; and on the rim of a patch a fin stands upon the surface. What
sticks out of the body is thrown away after meshing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import Box
from estimator.geometry.imprint import imprint_box, imprint_levels, rim, triangles_in_box
from estimator.geometry.painted import Painted
from estimator.surfaces.queries import inside, nearest
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Lengths below this share of the bounding box's diagonal do not matter: a box that reaches no deeper into the
# tissue holds its surface, and a face of a box that lies no farther below the surface means the surface.
_TOLERANCE = 2e-3
_SAMPLES = 16


Region: TypeAlias = Box | Painted


@dataclass(frozen=True, eq=False)
class Hold:
    """A held region.

    Attributes
    ----------
    patch : (t,) bool, triangles of the imprinted surface in it
    core : box whose tissue is rigid and is cut away; None where the surface alone is held
    walls : (w, 3, 3) float64, triangles that the mesh has to follow, m
    area_m2 : of what is held: the walls' part in the tissue, or the patch
    volume_m3 : of the tissue that is cut away
    """

    patch: BoolArray
    core: Box | None
    walls: FloatArray
    area_m2: float
    volume_m3: float


@dataclass(frozen=True, eq=False)
class HeldSurface:
    """A surface with its held regions imprinted: every triangle lies in a region or out of it."""

    surface: Surface
    holds: Mapping[str, Hold]

    @property
    def remaining(self) -> BoolArray:
        """Triangles (t,) that bound the tissue that is left."""
        kept = np.ones(len(self.surface.triangles), dtype=bool)
        for hold in self.holds.values():
            if hold.core is not None:
                kept &= ~hold.patch
        return kept

    @property
    def volume_m3(self) -> float:
        """Of the tissue that is left."""
        return self.surface.volume_m3 - sum(hold.volume_m3 for hold in self.holds.values())


def hold_regions(surface: Surface, regions: Mapping[str, Region], reach_m: float) -> HeldSurface:
    """Imprint regions that do not overlap into a surface.

    Parameters
    ----------
    surface : Surface
    regions : boxes, and patches of ``surface``, by name
    reach_m : by which walls and fins stand out of the body

    Raises
    ------
    InputError
        A region holds no tissue, or all of it; the message names it.
    """
    painted = {name: region.level for name, region in regions.items() if isinstance(region, Painted)}
    levels = np.array(list(painted.values())).reshape(len(painted), len(surface.vertices)).T
    imprinted, patches = imprint_levels(surface, levels)
    patch_of = dict(zip(painted, patches.T, strict=True))
    tolerance = _TOLERANCE * surface.diagonal_m
    cuts = {name: _cut(surface, box, tolerance) for name, box in regions.items() if isinstance(box, Box)}
    parent = np.arange(len(imprinted.triangles))
    for cut in cuts.values():
        imprinted, origin = imprint_box(imprinted, cut.box, tolerance)
        parent = parent[origin]
    holds = {}
    for name in regions:
        if name in patch_of:
            hold = _patch(imprinted, patch_of[name][parent], reach_m)
        else:
            patch, core = triangles_in_box(imprinted, cuts[name].box), cuts[name].faces.any()
            hold = _core(imprinted, patch, cuts[name], reach_m) if core else _patch(imprinted, patch, reach_m)
        if not hold.area_m2 > 0 or (hold.core is None and hold.patch.all()):
            held = "all of the tissue" if hold.patch.all() else "no tissue"
            remedy = (
                "paint it on this surface, in its frame" if name in patch_of else "correct its box, in metres"
            )
            raise InputError(f"{name} holds {held}; {remedy}")
        holds[name] = hold
    return HeldSurface(imprinted, holds)


@dataclass(frozen=True, eq=False)
class _Cut:
    """A box, and which of its lower and upper faces (2, 3) cut through tissue; the others lie just outside of it."""

    box: Box
    faces: BoolArray


def _cut(surface: Surface, region: Box, tolerance: float) -> _Cut:
    """Find the faces of a box that cut through tissue, and move the others out of it."""
    corners = np.clip([region.lower, region.upper], *surface.bounds)
    faces = np.zeros((2, 3), dtype=bool)
    for side in range(2):
        for axis in range(3):
            points = _grid(corners, side, axis)
            points = points[inside(surface, points)]
            _, foot = nearest(surface.corners, points)
            faces[side, axis] = np.any(np.linalg.norm(points - foot, axis=1) > tolerance)
    if not faces.any():
        return _Cut(region, faces)
    outward = np.array([[-1.0], [1.0]]) * tolerance
    return _Cut(_box(np.where(faces, corners, corners + outward)), faces)


def _grid(corners: FloatArray, side: int, axis: int) -> FloatArray:
    """Return the centres (n, 3) of the cells of a grid on a face of a box."""
    share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    lines = [low + share * (high - low) for low, high in corners.T]
    lines[axis] = corners[side, axis : axis + 1]
    return np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 3)


def _patch(surface: Surface, patch: BoolArray, reach_m: float) -> Hold:
    edges = rim(surface, patch)
    normals = np.zeros_like(surface.vertices)
    np.add.at(normals, surface.triangles, surface.area_vectors[:, None])
    tips = surface.vertices[edges] + reach_m * _unit(normals[edges])
    a, b = surface.vertices[edges].transpose(1, 0, 2)
    fins = np.concatenate(
        [np.stack([a, b, tips[:, 1]], axis=1), np.stack([a, tips[:, 1], tips[:, 0]], axis=1)]
    )
    return Hold(patch, None, fins, float(surface.areas[patch].sum()), 0.0)


def _core(surface: Surface, patch: BoolArray, cut: _Cut, reach_m: float) -> Hold:
    corners = np.array([cut.box.lower, cut.box.upper])
    stretched = np.where(cut.faces, corners, corners + np.array([[-reach_m], [reach_m]]))
    walls = [_rectangle(stretched, side, axis) for side, axis in np.argwhere(cut.faces)]
    area = sum(_wall_area(surface, corners, side, axis) for side, axis in np.argwhere(cut.faces))
    return Hold(patch, cut.box, np.concatenate(walls), area, _volume(surface, patch, corners))


def _rectangle(corners: FloatArray, side: int, axis: int) -> FloatArray:
    """Return a face of a box as two triangles, (2, 3, 3)."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    points = np.tile(corners[side], (4, 1))
    points[:, u] = corners[[0, 1, 1, 0], u]
    points[:, v] = corners[[0, 0, 1, 1], v]
    return points[[[0, 1, 2], [0, 2, 3]]]


def _wall_area(surface: Surface, corners: FloatArray, side: int, axis: int) -> float:
    """Return the area of a face of a box within the tissue, m².

    The face closes the body that it cuts out of the tissue beyond it. The area vectors of a closed body sum to zero,
    and the sides of this one are parallel to the normal.
    """
    beyond = corners.copy()
    beyond[1 - side, axis] = corners[side, axis]
    beyond[side, axis] = surface.bounds[side, axis] + (2 * side - 1) * surface.diagonal_m
    prism = _box(beyond)
    imprinted, _ = imprint_box(surface, prism, 0.0)
    facing = imprinted.area_vectors[triangles_in_box(imprinted, prism), axis]
    return abs(float(facing.sum()))


def _volume(surface: Surface, patch: BoolArray, corners: FloatArray) -> float:
    """Return the volume of the tissue in a box, m³: the flux of (x − x₀, 0, 0), x₀ at the lower face, through it."""
    from_lower_face = surface.corners[patch, :, 0].mean(axis=1) - corners[0, 0]
    through_patch = float(from_lower_face @ surface.area_vectors[patch, 0])
    return through_patch + float(corners[1, 0] - corners[0, 0]) * _wall_area(surface, corners, 1, 0)


def _box(corners: FloatArray) -> Box:
    (x0, y0, z0), (x1, y1, z1) = corners.tolist()
    return Box((x0, y0, z0), (x1, y1, z1))


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
