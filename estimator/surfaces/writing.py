"""Writes surfaces as STL and PLY files in metres."""

from pathlib import Path

import numpy as np

from estimator.surfaces.surface import Surface

_STL_HEADER_BYTES = 80
_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


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
