"""Writes meshes of tetrahedra as VTK XML UnstructuredGrid files, for ParaView and its kin."""

import base64
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.fem.discretisation.mesh import Mesh

# VTK's numbers of the kinds of cells; it orders the nodes of a quadratic tetrahedron as we do.
_CELL_TYPES = {"tet4": 10, "tet10": 24}
_TYPE_NAMES = {"f8": "Float64", "i8": "Int64", "u1": "UInt8"}


def write_vtu(mesh: Mesh, point_data: Mapping[str, NDArray[np.generic]], file: Path | str) -> None:
    """Write a mesh with values at its nodes.

    Parameters
    ----------
    mesh : Mesh, tet4 or tet10
    point_data : arrays (n,) or (n, c) of float64, int64 or bool, by name
    file : to write, over any that is there

    Raises
    ------
    InputError
        The mesh is not of tetrahedra.
    """
    if mesh.kind not in _CELL_TYPES:
        raise InputError(f"{file}: a mesh of {mesh.kind} cannot be written as VTU; give one of tet4 or tet10")
    count, nodes = mesh.cells.shape
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        f'<UnstructuredGrid><Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{count}">',
        "<PointData>",
        *(_array(name, values) for name, values in point_data.items()),
        "</PointData><Points>",
        _array("Points", mesh.points),
        "</Points><Cells>",
        _array("connectivity", mesh.cells.ravel()),
        _array("offsets", nodes * np.arange(1, count + 1)),
        _array("types", np.full(count, _CELL_TYPES[mesh.kind], dtype=np.uint8)),
        "</Cells></Piece></UnstructuredGrid></VTKFile>",
    ]
    Path(file).write_text("\n".join(lines) + "\n", encoding="ascii")


def _array(name: str, values: NDArray[np.generic]) -> str:
    if values.dtype == bool:
        values = values.astype(np.uint8)
    little = values.astype(values.dtype.newbyteorder("<"))
    content = np.uint64(little.nbytes).tobytes() + little.tobytes()
    columns = values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray Name={quoteattr(name)} type="{_TYPE_NAMES[values.dtype.str[1:]]}" '
        f'NumberOfComponents="{columns}" format="binary">{base64.b64encode(content).decode()}</DataArray>'
    )
