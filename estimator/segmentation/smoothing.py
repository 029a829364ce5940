"""A smooth closed surface around voxels, of their volume.

The voxels are smoothed by a Gaussian, whose width is that of a voxel along each axis, so that the steps between slices
go as well; the surface is the level that encloses the volume of the voxels. Then edges are collapsed within a
tolerance, and what that took of the volume is given back along the normals.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from estimator.errors import InputError
from estimator.segmentation.isosurface import Isosurface, isosurface
from estimator.surfaces.decimation import collapsed
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Of the Gaussian, in voxels; the next is tried where what is thin would be lost.
_WIDTHS = (1.0, 0.7, 0.5)
# Dice's coefficient of the voxels and those within the surface, below which something is lost.
_ENOUGH_IN_COMMON = 0.95
# The surface may move by this share of a voxel when edges are collapsed.
_TOLERANCE = 0.15
# Grids are halved until none of their edges has more voxels: what is left is finer than any mesh.
_LONGEST = 300
_ROUNDS = 8
_SAME_VOLUME = 1e-4


@dataclass(frozen=True, eq=False)
class SmoothShell:
    """A surface around voxels.

    Attributes
    ----------
    surface : Surface, m, anticlockwise seen from outside of the voxels
    voxels_m3 : volume of the voxels
    in_common : Dice's coefficient of the voxels and of those whose centres it encloses
    """

    surface: Surface
    voxels_m3: float
    in_common: float

    @property
    def volume_error(self) -> float:
        """By which share the surface's volume differs from that of the voxels."""
        return self.surface.volume_m3 / self.voxels_m3 - 1


def smooth_shell(mask: BoolArray, T_frame_index: FloatArray, source: str) -> SmoothShell:
    """Return the surface around voxels that hang together and have no hole.

    Parameters
    ----------
    mask : (i, j, k) bool
    T_frame_index : (4, 4), from the index of a voxel to its centre, m
    source : as messages name it

    Raises
    ------
    InputError
        The voxels are too thin for a surface of their volume.
    """
    grid, T_frame_grid = _cropped(mask, T_frame_index)
    wanted = float(grid.sum(dtype=np.float64))
    problem: InputError | None = None
    for width in _WIDTHS:
        field = ndimage.gaussian_filter(grid, width, truncate=3.0, mode="constant")
        found, level = _of_volume(field, wanted)
        within, voxels = field > level, grid > 0.5
        in_common = (
            2 * np.count_nonzero(within & voxels) / (np.count_nonzero(within) + np.count_nonzero(voxels))
        )
        try:
            surface = _surface(found, T_frame_grid, wanted, source)
        except InputError as error:  # it has fallen into parts
            problem = error
            continue
        if in_common >= _ENOUGH_IN_COMMON or width == _WIDTHS[-1]:
            cell = float(abs(np.linalg.det(T_frame_grid[:3, :3])))
            return SmoothShell(surface, wanted * cell, in_common)
    raise problem or InputError(f"{source}: no surface has the volume of its voxels; segment it more finely")


def _cropped(mask: BoolArray, T_frame_index: FloatArray) -> tuple[NDArray[np.float32], FloatArray]:
    """Return how full each voxel is, with empty ones around, on a coarser grid where there are very many of them."""
    (box,) = ndimage.find_objects(mask.astype(np.uint8))
    T_frame_grid = T_frame_index.copy()
    T_frame_grid[:3, 3] += T_frame_index[:3, :3] @ [part.start for part in box]
    full = mask[box].astype(np.float32)
    while max(full.shape) > _LONGEST:
        full = np.pad(full, [(0, count % 2) for count in full.shape])
        full = full.reshape(*np.ravel([(count // 2, 2) for count in full.shape])).mean(axis=(1, 3, 5))
        # the centre of the first of the larger voxels lies half a smaller one on
        T_frame_grid[:3, 3] += T_frame_grid[:3, :3] @ (0.5, 0.5, 0.5)
        T_frame_grid[:3, :3] *= 2
    margin = 4
    T_frame_grid[:3, 3] -= margin * T_frame_grid[:3, :3].sum(axis=1)
    return np.pad(full, margin), T_frame_grid


def _of_volume(field: NDArray[np.float32], wanted: float) -> tuple[Isosurface, float]:
    """Return the surface of the level that encloses a volume, in cells, and the level."""
    low, high, level = 0.0, float(field.max()), 0.5 * min(1.0, float(field.max()))
    found = isosurface(field, level)
    for _ in range(_ROUNDS):
        off = found.volume - wanted
        if abs(off) <= _SAME_VOLUME * wanted:
            break
        low, high = (level, high) if off > 0 else (low, level)
        # by how much the surface moves as the level does, in the mean
        step = off / found.area * _slope(field, found)
        level = level + step if low < level + step < high else (low + high) / 2
        found = isosurface(field, level)
    return found, level


def _slope(field: NDArray[np.float32], at: Isosurface) -> float:
    """Return how steep the field is on a surface, in the mean."""
    some = at.vertices[:: max(1, len(at.vertices) // 5000)].T
    ways = [
        ndimage.map_coordinates(field, some + 0.5 * np.eye(3)[axis][:, None], order=1)
        - ndimage.map_coordinates(field, some - 0.5 * np.eye(3)[axis][:, None], order=1)
        for axis in range(3)
    ]
    return float(np.linalg.norm(ways, axis=0).mean())


def _surface(found: Isosurface, T_frame_grid: FloatArray, cells: float, source: str) -> Surface:
    """Return the surface in the frame, m, with fewer triangles and the volume of so many cells."""
    linear = T_frame_grid[:3, :3]
    vertices = found.vertices @ linear.T + T_frame_grid[:3, 3]
    triangles = found.triangles if np.linalg.det(linear) > 0 else found.triangles[:, ::-1]
    voxel = float(np.linalg.norm(linear, axis=0).min())
    fewer = collapsed(Surface(vertices, triangles), _TOLERANCE * voxel, source)
    surface = closed_surface(fewer.vertices, fewer.triangles, source)
    volume = cells * abs(float(np.linalg.det(linear)))
    for _ in range(2):
        surface = _inflated(surface, (volume - surface.volume_m3) / surface.areas.sum())
    return surface


def _inflated(surface: Surface, by_m: float) -> Surface:
    """Move the vertices of a surface outward."""
    normals = np.zeros_like(surface.vertices)
    np.add.at(normals, surface.triangles, surface.area_vectors[:, None])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Surface(surface.vertices + by_m * normals, surface.triangles)
