"""Writes meshes as VTK XML UnstructuredGrid files, for ParaView and its kin; regions and node sets as 0 and 1."""

import base64
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from estimator.meshes.volume_mesh import MIRRORED, CellKind, VolumeMesh

# VTK's numbers of the kinds of cells.
_CELL_TYPES: dict[CellKind, int] = {"tet4": 10, "tet10": 24, "pyramid5": 14, "wedge6": 13, "hex8": 12}
_TYPE_NAMES = {"f8": "Float64", "i8": "Int64", "u1": "UInt8"}


def write_vtu(mesh: VolumeMesh, file: Path | str) -> None:
    """Write a mesh over any file that is there."""
    sizes = np.concatenate([np.full(len(cells), cells.shape[1]) for cells in mesh.blocks.values()])
    types = np.concatenate([np.full(len(cells), _CELL_TYPES[kind]) for kind, cells in mesh.blocks.items()])
    regions = {
        name: np.concatenate([mesh.members(name, kind) for kind in mesh.blocks]) for name in mesh.regions
    }
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        f'<UnstructuredGrid><Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(sizes)}">',
        "<PointData>",
        *(_array(name, nodes) for name, nodes in mesh.node_sets.items()),
        "</PointData><CellData>",
        *(_array(name, inside) for name, inside in regions.items()),
        "</CellData><Points>",
        _array("Points", mesh.points),
        "</Points><Cells>",
        _array("connectivity", np.concatenate([_in_vtk_order(kind, mesh).ravel() for kind in mesh.blocks])),
        _array("offsets", np.cumsum(sizes)),
        _array("types", types.astype(np.uint8)),
        "</Cells></Piece></UnstructuredGrid></VTKFile>",
    ]
    Path(file).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _in_vtk_order(kind: CellKind, mesh: VolumeMesh) -> NDArray[np.int64]:
    """Return the nodes of elements; the first triangle of VTK's wedge looks out of it, that of others into it."""
    return mesh.blocks[kind][:, MIRRORED[kind]] if kind == "wedge6" else mesh.blocks[kind]


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
