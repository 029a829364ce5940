"""Triangles of an STL file, binary or text."""

import re
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.experiment.model import FloatArray
from estimator.input_file import read_input

MOST_SURFACE_BYTES = 200_000_000
"""Largest file of a surface that is read."""

_HEADER_BYTES = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(r"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)\s*$", re.MULTILINE)


def read_stl(file: Path) -> FloatArray:
    """Return the corners of every triangle, (n, 3, 3), in the file's unit.

    Raises
    ------
    InputError
        The file is missing, cut short, or no STL.
    """
    content = read_input(file, MOST_SURFACE_BYTES)
    count = int.from_bytes(content[80:_HEADER_BYTES], "little")
    if len(content) > _HEADER_BYTES and len(content) == _HEADER_BYTES + count * _TRIANGLE.itemsize:
        single = np.frombuffer(content, _TRIANGLE, offset=_HEADER_BYTES)["vertices"]
        with np.errstate(invalid="ignore"):  # bits that are no number are refused below
            triangles = single.astype(np.float64)
    else:
        triangles = _text_triangles(content)
    if not len(triangles) or not np.isfinite(triangles).all():
        raise InputError(f"{file}: not a complete STL file; export the closed surface again, in metres")
    return triangles


def _text_triangles(content: bytes) -> FloatArray:
    vertices = _VERTEX.findall(content.decode("ascii", errors="replace"))
    try:
        corners = np.array(vertices, dtype=np.float64)
    except ValueError:
        return np.empty((0, 3, 3))
    return corners.reshape(-1, 3, 3) if len(corners) % 3 == 0 else np.empty((0, 3, 3))
