"""Reads closed surfaces from STL, PLY, OBJ and VTP files in metres, and writes STL and PLY."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimator.errors import InputError
from estimator.experiment.stl import MOST_SURFACE_BYTES, read_stl
from estimator.geometry.obj import read_obj
from estimator.geometry.ply import read_ply
from estimator.geometry.surface import Surface, closed_surface
from estimator.geometry.vtp import read_vtp
from estimator.input_file import read_input

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
PolygonReader: TypeAlias = Callable[[bytes, Path], tuple[ArrayLike, Sequence[Sequence[int]]]]

_POLYGON_READERS: dict[str, PolygonReader] = {".ply": read_ply, ".obj": read_obj, ".vtp": read_vtp}
SUFFIXES = (".stl", *_POLYGON_READERS)

_STL_HEADER_BYTES = 80
_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_surface(file: Path | str) -> Surface:
    """Read a closed surface; polygons are split into triangles, equal vertices welded, triangles turned outward.

    Raises
    ------
    InputError
        The file is missing, too large, of another kind or damaged, or its triangles are no closed surface in
        metres; the message names the file and, where there is one, the line.
    """
    path = Path(file)
    suffix = path.suffix.lower()
    if suffix == ".stl":
        corners = read_stl(path)
        return closed_surface(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), str(path))
    if suffix not in _POLYGON_READERS:
        raise InputError(f"{path}: unknown kind of file; give a surface as {', '.join(SUFFIXES)}")
    vertices, polygons = _POLYGON_READERS[suffix](read_input(path, MOST_SURFACE_BYTES), path)
    points = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
    return closed_surface(points, _triangles(polygons, len(points), path), str(path))


def write_stl(surface: Surface, file: Path | str) -> None:
    """Write a binary STL file, m; coordinates are rounded to single precision."""
    triangles = np.zeros(len(surface.triangles), _STL_TRIANGLE)
    triangles["normal"] = surface.area_vectors / surface.areas[:, None]
    triangles["corners"] = surface.corners
    count = np.uint32(len(triangles)).tobytes()
    Path(file).write_bytes(b"closed surface, metres".ljust(_STL_HEADER_BYTES) + count + triangles.tobytes())


def write_ply(surface: Surface, file: Path | str) -> None:
    """Write a binary PLY file, m, in double precision."""
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment metres\n"
        f"element vertex {len(surface.vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(surface.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(surface.triangles), np.dtype([("count", "u1"), ("nodes", "<i4", 3)]))
    faces["count"], faces["nodes"] = 3, surface.triangles
    Path(file).write_bytes(header.encode() + surface.vertices.astype("<f8").tobytes() + faces.tobytes())


def _triangles(polygons: Sequence[Sequence[int]], vertices: int, file: Path) -> IntArray:
    """Split polygons into fans of triangles."""
    triangles = []
    for number, polygon in enumerate(polygons):
        if len(polygon) < 3 or min(polygon) < 0 or max(polygon) >= vertices:
            raise InputError(
                f"{file}: face {number} (from 0) names {list(polygon)[:6]} of {vertices} vertices; "
                "export the surface again"
            )
        triangles += [(polygon[0], b, c) for b, c in pairwise(polygon[1:])]
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)
